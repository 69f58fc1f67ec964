"""Ramps: a rise from 0 to 1, linear or smooth."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["linear_ramp", "smooth_step"]


def linear_ramp(x: FloatArray, begin: FloatArray | float, end: FloatArray | float) -> FloatArray:
    """Return 0 up to `begin`, 1 from `end` on, and linear between; it falls where `end` is less."""
    return np.asarray(np.clip((x - begin) / (end - begin), 0.0, 1.0))


def smooth_step(x: FloatArray) -> FloatArray:
    """Return 3 x^2 - 2 x^3 of an array, 0 below 0 and 1 above 1: level at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
