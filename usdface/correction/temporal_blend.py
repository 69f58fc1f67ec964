"""Blending in: a correction comes and goes gently, and does not flicker with what it corrects.

Raising a weight w to a pose's p adds max(0, p - w), which holds the jitter of w upside down and
starts with a kink. What is added instead is a smooth curve nowhere below that, so that raising
twice is still raising once: what has been raised to a pose, or beyond it, is added nothing.
Nor does the curve lead beyond the pose while the weight is still on its way there.
What contact takes back of a correction is taken back as smoothly.
"""

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter1d

from usdface.arrays import FloatArray

__all__ = ["blend_frames", "blended_in", "blended_out"]


def blend_frames(times: FloatArray, blend_time: float) -> int:
    """Return the frames that a blend time [s] lasts, at the median step of `times` (F,) [s]."""
    if len(times) < 2:
        return 0
    return round(blend_time / float(np.median(np.diff(times))))


def blended_in(weights: FloatArray, raised: FloatArray, frames: int) -> FloatArray:
    """Return raised weights that leave `weights`, and come back to them, within some frames.

    Parameters
    ----------
    weights, raised : (F, S) float64 in [0, 1]
        Nowhere is `raised` below `weights`.
    frames : int
        0 or 1 changes nothing.

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
        begun, asked = weights[:, moved], raised[:, moved]
        added = np.minimum(_cover(asked - begun, frames), _room(begun, asked, frames))
        # What is covered may round to less than it was.
        blended[:, moved] = np.maximum(np.minimum(begun + added, 1.0), asked)
    return blended


def blended_out(
    weights: FloatArray, corrected: FloatArray, held: FloatArray, frames: int
) -> FloatArray:
    """Return corrected weights of which more and more is taken back, where any must be.

    Parameters
    ----------
    weights, corrected, held : (F, S) float64
        Everywhere `held` is between the other two.
    frames : int
        0 or 1 gives `held`.

    Returns
    -------
    (F, S) float64
        Nowhere further from `weights` than `held`; `corrected` where nothing is held back within
        `frames`.
    """
    wanted = corrected - weights
    back = np.minimum(_cover(np.abs(corrected - held), frames), np.abs(wanted))
    kept = weights + np.copysign(np.abs(wanted) - back, wanted)
    return np.asarray(np.where(back > 0, kept, corrected))


def _cover(values: FloatArray, frames: int) -> FloatArray:
    """Return a smooth curve over each column of values (F, S) >= 0, nowhere below it.

    The average by a Hann window of half of `frames` on either side; where that is short of the
    values, the largest shortage within as many frames is averaged likewise and added. All that is
    averaged then is at least the frame's own shortage.
    """
    moved = np.flatnonzero(values.any(axis=0))
    if frames < 2 or not moved.size:
        return values
    smooth = _averaged(values[:, moved], frames)
    cover = np.zeros(values.shape)
    cover[:, moved] = smooth + _envelope(np.maximum(values[:, moved] - smooth, 0.0), frames)
    return cover


def _room(weights: FloatArray, raised: FloatArray, frames: int) -> FloatArray:
    """Return a smooth curve (F, S) that what is added to weights may not exceed.

    It leads their average to what is raised nearby, and further by their jitter, or the sum would
    be level and what is added the jitter upside down. Nowhere is it below raised - weights.
    """
    # Over half as long as all else: a movement is not to pass for jitter.
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
