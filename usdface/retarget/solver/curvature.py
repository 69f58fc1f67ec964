"""The curvature of curves over time as a banded matrix."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["curvature_bands"]

# Steps of time that differ by less, relatively, differ by rounding: a time of an hour is rounded to
# 5e-13 s, 6e-11 of a step at 120 Hz.
_EVEN = 1e-8


def curvature_bands(times: FloatArray) -> FloatArray:
    """Return the pentadiagonal matrix of ``integral |w''|^2 dt`` for samples at `times`.

    Returns
    -------
    (3, F) float64 [1/s^3]
        Upper banded storage, as `scipy.linalg.solveh_banded` takes it; uneven times are
        allowed, fewer than three give zeros.
    """
    count = len(times)
    bands = np.zeros((3, count))
    if count < 3:
        return bands
    step = np.diff(times)
    if np.ptp(step) <= _EVEN * step.mean():
        step[:] = step.mean()
    span = step[:-1] + step[1:]
    # w'' at an inner sample as a combination of three neighbours, times sqrt(span / 2).
    scale = np.sqrt(span / 2.0) * 2.0 / span
    left, right = scale / step[:-1], scale / step[1:]
    middle = -(left + right)
    bands[2, :-2] += left**2
    bands[2, 1:-1] += middle**2
    bands[2, 2:] += right**2
    bands[1, 1:-1] += left * middle
    bands[1, 2:] += middle * right
    bands[0, 2:] += left * right
    return bands
