"""The performer's neutral: mean positions of the markers in the neutral frames."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import POSE_MARKERS, rigid_fit
from usdface.numerics.seen_mean import seen_mean
from usdface.setup.retarget_setup import check_neutral_frames

__all__ = ["neutral_markers", "on_plane", "resting_frames"]

# The face moves in a neutral frame whose markers are so many times as far from their median places
# as in half of the frames: lids are half closed, with 68 markers and 0.3 mm of noise. An even
# change stays within it, and so does noise, which differs by so many deviations with few markers.
_FAR, _DEVIATIONS = 2.0, 5.0
# ... and by this share of the face's size, 0.6 mm on the ICT face: real rests drift by less.
_STILL = 0.01
# Of fewer frames none is left out: they have no typical distance.
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
        In the head pose of the resting frame that shows most markers, the first of several; NaN
        for a marker that no neutral frame shows. One that no resting frame shows is averaged over
        the others.

    Raises
    ------
    InputError
        If the range lies outside the take.
    """
    resting = resting_frames(positions, frames)
    still = _still(positions[frames[0] : frames[1] + 1], resting)
    mean = seen_mean(np.where(resting[:, None, None], still, np.nan))
    mean = np.where(np.isnan(mean), seen_mean(still), mean)
    return np.asarray(mean[:, : positions.shape[-1]])


def resting_frames(positions: FloatArray, frames: tuple[int, int]) -> BoolArray:
    """Return the neutral frames in which the face rests: (N,), False where it blinks, say.

    Those that are as near to the median as most are; all in an image, where the head may turn.
    Parameters and errors are those of `neutral_markers`.
    """
    check_neutral_frames(frames, len(positions))
    first, last = frames
    window = positions[first : last + 1]
    resting = np.ones(len(window), dtype=bool)
    seen = ~np.isnan(window[..., 0])
    shown, known = seen.any(axis=1), seen.any(axis=0)
    if positions.shape[-1] == 2 or shown.sum() < _FEWEST:
        return resting
    space = _still(window, resting)[shown][:, known]
    median, seen = np.nanmedian(space, axis=0), seen[shown][:, known]
    squares = np.where(seen, ((space - median) ** 2).sum(axis=2), 0.0).sum(axis=1)
    away = np.sqrt(squares / seen.sum(axis=1))
    times = max(_FAR, 1.0 + _DEVIATIONS / np.sqrt(2.0 * median.size))
    resting[shown] = away <= max(times * np.median(away), _STILL * rms_radius(median))
    return resting


def _still(window: FloatArray, resting: BoolArray) -> FloatArray:
    """Return markers (N, M, 3) in the head pose of the resting frame (N,) that shows most."""
    seen = ~np.isnan(window[..., 0])
    most = int(np.argmax(np.where(resting, seen.sum(axis=1), -1)))
    space = on_plane(window)
    if seen[most].sum() < POSE_MARKERS:
        return space
    pose, _ = rigid_fit(space[most], space)
    return pose.to_head(space)
