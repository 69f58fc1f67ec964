"""The performer's neutral: mean positions of the markers in the neutral frames."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.geometry.rigid_fit import POSE_MARKERS, rigid_fit

__all__ = ["neutral_markers", "on_plane"]


def on_plane(positions: FloatArray) -> FloatArray:
    """Return image markers (..., 2) as points (..., 3) on the plane z = 0; 3D ones as they are."""
    if positions.shape[-1] == 3:
        return positions
    flat = np.zeros((*positions.shape[:-1], 3))
    flat[..., :2] = positions
    flat[np.isnan(positions[..., 0])] = np.nan
    return flat


def neutral_markers(positions: FloatArray, frames: tuple[int, int]) -> FloatArray:
    """Average each marker over the neutral frames, with the head's motion taken out.

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
    if (~np.isnan(window[most, :, 0])).sum() >= POSE_MARKERS:
        pose, _ = rigid_fit(space[most], space)
        space = pose.to_head(space)
    count = (~np.isnan(space)).sum(axis=0)
    mean = np.where(count > 0, np.nansum(space, axis=0) / np.maximum(count, 1), np.nan)
    return np.asarray(mean[:, : positions.shape[-1]])
