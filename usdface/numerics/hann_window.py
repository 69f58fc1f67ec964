"""Averages of curves by a Hann window, and envelopes that are as smooth."""

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter1d

from usdface.arrays import FloatArray

__all__ = ["hann_average", "hann_envelope"]


def hann_average(values: FloatArray, frames: int) -> FloatArray:
    """Return the average of values (F, ...) by a Hann window of half of `frames` on either side."""
    window = np.hanning(_width(frames) + 2)[1:-1]
    return np.asarray(convolve1d(values, window / window.sum(), axis=0, mode="nearest"))


def hann_envelope(values: FloatArray, frames: int) -> FloatArray:
    """Return the largest of values (F, ...) within half of `frames`, averaged over as many.

    It is nowhere less than the values, as each value is the largest in every part of its average.
    """
    largest = maximum_filter1d(values, _width(frames), axis=0, mode="nearest")
    return hann_average(largest, frames)


def _width(frames: int) -> int:
    return 2 * (frames // 2) + 1
