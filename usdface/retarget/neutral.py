"""The performer's neutral: mean positions of the markers in the neutral frames."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import POSE_MARKERS, rigid_fit

__all__ = ["neutral_markers", "on_plane", "resting_frames"]

# The face moves in neutral frames that are so many times as far from their median as half of them,
# and by this share of its size (0.6 mm on the ICT face). With 68 markers and 0.3 mm of noise lids
# are half closed there. A face that changes evenly is not as far, nor is noise, which differs more
# with few markers, by so many standard deviations. Of fewer frames none is left out.
_FAR, _DEVIATIONS = 2.0, 5.0
_STILL = 0.01
_FEWEST = 5


def on_plane(positions: FloatArray) -> FloatArray:
    """Return image markers (..., 2) as points (..., 3) on the plane z = 0; 3D ones as they are."""
    if positions.shape[-1] == 3:
        return positions
    flat = np.zeros((*positions.shape[:-1], 3))
    flat[..., :2] = positions
    flat[np.isnan(positions[..., 0])] = np.nan
    return flat


def neutral_markers(positions: FloatArray, frames: tuple[int, int]) -> FloatArray:
    """Average each marker over the neutral frames in which the face rests, in one head pose.

    Parameters
    ----------
    positions : (F, M, D) float64
    frames : (int, int)
        First and last neutral frame index, inclusive.

    Returns
    -------
    (M, D) float64
        In the head pose of the neutral frame that shows most markers, the first of several; NaN
        for a marker that no neutral frame shows.

    Raises
    ------
    InputError
        If the range lies outside the take.
    """
    space = _still(positions, frames)
    resting = _resting(space, positions.shape[-1])[:, None, None]
    count = (~np.isnan(space) & resting).sum(axis=0)
    total = np.nansum(np.where(resting, space, 0.0), axis=0)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return np.asarray(mean[:, : positions.shape[-1]])


def resting_frames(positions: FloatArray, frames: tuple[int, int]) -> BoolArray:
    """Return the neutral frames in which the face rests: (N,), False where it blinks, say.

    Parameters and errors are those of `neutral_markers`.
    """
    return _resting(_still(positions, frames), positions.shape[-1])


def _still(positions: FloatArray, frames: tuple[int, int]) -> FloatArray:
    """Return the markers in the neutral frames without the head's motion: (N, M, 3)."""
    first, last = frames
    if not 0 <= first <= last < len(positions):
        raise InputError(
            f"neutral frames {first} to {last} lie outside the take, "
            f"which has frames 0 to {len(positions) - 1}",
            "FRAMES_OUTSIDE",
        )
    window = positions[first : last + 1]
    most = int(np.argmax((~np.isnan(window[..., 0])).sum(axis=1)))
    space = on_plane(window)
    if (~np.isnan(window[most, :, 0])).sum() < POSE_MARKERS:
        return space
    pose, _ = rigid_fit(space[most], space)
    return pose.to_head(space)


def _resting(space: FloatArray, dimension: int) -> BoolArray:
    """Return the frames (N,) that are as near to the median as most are; all, in an image.

    There the head may turn.
    """
    resting = np.ones(len(space), dtype=bool)
    known = ~np.isnan(space[..., 0]).all(axis=0)
    if dimension == 2 or len(space) < _FEWEST or not known.any():
        return resting
    space = space[:, known]
    median = np.nanmedian(space, axis=0)
    seen = ~np.isnan(space[..., 0])
    squares = np.where(seen, ((space - median) ** 2).sum(axis=2), 0.0).sum(axis=1)
    away = np.sqrt(squares / np.maximum(seen.sum(axis=1), 1))
    times = max(_FAR, 1.0 + _DEVIATIONS / np.sqrt(2.0 * median.size))
    return np.asarray(away <= max(times * np.median(away), _STILL * rms_radius(median)))
