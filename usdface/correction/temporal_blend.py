"""Temporal blending: a correction begins and ends smoothly, and without the jitter of the weights.

Raising a weight w to a pose's p adds max(0, p - w), which has the inverted jitter of w and starts
with a kink. The smooth curve that is added instead is nowhere below that, and 0 where w reaches p,
so that raising stays idempotent. It does not lead beyond the pose while the weight still rises.
Reductions of a correction to keep contact (`usdface.correction.contact`) are smoothed likewise.
"""

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter1d

from usdface.arrays import FloatArray

__all__ = ["blend_frames", "blend_in", "blend_out"]


def blend_frames(times: FloatArray, blend_time: float) -> int:
    """Return the frames that a blend time [s] lasts, at the median step of `times` (F,) [s]."""
    if len(times) < 2:
        return 0
    return round(blend_time / float(np.median(np.diff(times))))


def blend_in(weights: FloatArray, raised: FloatArray, frames: int) -> FloatArray:
    """Return raised weights with smooth transitions from `weights` and back to them.

    Parameters
    ----------
    weights, raised : (F, S) float64 in [0, 1]
        Nowhere is `raised` below `weights`.
    frames : int
        Length of a transition; 0 or 1 changes nothing.

    Returns
    -------
    (F, S) float64 in [0, 1]
        Nowhere below `raised`, nor beyond the largest of it within `frames` but for the jitter
        of `weights`; `weights` where nothing is raised within `frames`.
    """
    if frames < 2:
        return raised
    blended = weights.copy()
    moved = np.flatnonzero((raised > weights).any(axis=0))
    if moved.size:
        before, target = weights[:, moved], raised[:, moved]
        added = np.minimum(
            _smooth_bound(target - before, frames), _largest_addition(before, target, frames)
        )
        # Sums may round to less than the target.
        blended[:, moved] = np.maximum(np.minimum(before + added, 1.0), target)
    return blended


def blend_out(
    weights: FloatArray, corrected: FloatArray, limited: FloatArray, frames: int
) -> FloatArray:
    """Return corrected weights with smooth transitions to the limited ones.

    Parameters
    ----------
    weights, corrected, held : (F, S) float64
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


def _largest_addition(weights: FloatArray, raised: FloatArray, frames: int) -> FloatArray:
    """Return a smooth upper limit (F, S) of the addition to weights.

    It leads their average to the largest raised weight nearby plus their jitter; without the
    latter the sum would be constant, and the addition the inverted jitter. Nowhere is it below
    raised - weights.
    """
    # Half the window of the rest, so that movements do not count as jitter.
    smooth = _averaged(weights, frames // 2)
    return _envelope(raised, frames) - smooth + _envelope(np.abs(weights - smooth), frames)


def _envelope(values: FloatArray, frames: int) -> FloatArray:
    """Return the largest of each column within half of `frames`, averaged likewise."""
    return _averaged(maximum_filter1d(values, _width(frames), axis=0, mode="nearest"), frames)


def _averaged(values: FloatArray, frames: int) -> FloatArray:
    """Average each column by a Hann window of half of `frames` on either side."""
    window = np.hanning(_width(frames) + 2)[1:-1]
    return np.asarray(convolve1d(values, window / window.sum(), axis=0, mode="nearest"))


def _width(frames: int) -> int:
    return 2 * (frames // 2) + 1
