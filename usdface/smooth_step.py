"""A smooth rise from 0 to 1, level at both ends."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["smooth_step"]


def smooth_step(x: FloatArray) -> FloatArray:
    """Return 3 x^2 - 2 x^3 of an array, 0 below 0 and 1 above 1."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
