"""Temporal blending: a correction begins and ends smoothly.

Additions are averaged; reductions to keep contact (`usdface.correction.contact`) get a smooth bound
that is nowhere below them.
"""

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter1d

from usdface.arrays import FloatArray
from usdface.takes import frame_step

__all__ = ["blend_frames", "blend_out", "blended"]


def blend_frames(times: FloatArray, blend_time: float) -> int:
    """Return the frames that a blend time [s] lasts, at the median step of `times` (F,) [s]."""
    if len(times) < 2:
        return 0
    return round(blend_time / frame_step(times))


def blended(added: FloatArray, frames: int) -> FloatArray:
    """Return the additions (F, S) of a correction averaged over `frames`; unchanged below 2.

    A curve that rises, holds and falls still does.
    """
    moved = np.flatnonzero(added.any(axis=0))
    if frames < 2 or not moved.size:
        return added
    smooth = np.zeros(added.shape)
    smooth[:, moved] = _averaged(added[:, moved], frames)
    return smooth


def blend_out(
    weights: FloatArray, corrected: FloatArray, limited: FloatArray, frames: int
) -> FloatArray:
    """Return corrected weights with smooth transitions to the limited ones.

    Parameters
    ----------
    weights, corrected, limited : (F, S) float64
        Everywhere `limited` is between the other two.
    frames : int
        Length of a transition; 0 or 1 gives `limited`.

    Returns
    -------
    (F, S) float64
        Nowhere further from `weights` than `limited`; `corrected` where nothing is limited within
        `frames`.
    """
    change = corrected - weights
    reduction = np.minimum(_smooth_bound(np.abs(corrected - limited), frames), np.abs(change))
    reduced = weights + np.copysign(np.abs(change) - reduction, change)
    return np.asarray(np.where(reduction > 0, reduced, corrected))


def _smooth_bound(values: FloatArray, frames: int) -> FloatArray:
    """Return a smooth upper bound of each column of values (F, S) >= 0.

    The average by a Hann window of half of `frames` on either side, plus its largest shortfall
    within as many frames, averaged likewise: every value in that average is at least the frame's
    own shortfall.
    """
    moved = np.flatnonzero(values.any(axis=0))
    if frames < 2 or not moved.size:
        return values
    smooth = _averaged(values[:, moved], frames)
    bound = np.zeros(values.shape)
    bound[:, moved] = smooth + _envelope(np.maximum(values[:, moved] - smooth, 0.0), frames)
    return bound


def _envelope(values: FloatArray, frames: int) -> FloatArray:
    """Return the largest of each column within half of `frames`, averaged likewise."""
    return _averaged(maximum_filter1d(values, _width(frames), axis=0, mode="nearest"), frames)


def _averaged(values: FloatArray, frames: int) -> FloatArray:
    """Average each column by a Hann window of half of `frames` on either side."""
    window = np.hanning(_width(frames) + 2)[1:-1]
    return np.asarray(convolve1d(values, window / window.sum(), axis=0, mode="nearest"))


def _width(frames: int) -> int:
    return 2 * (frames // 2) + 1
