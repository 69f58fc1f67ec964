"""Windows of a take: runs of frames whose mean has less noise than a frame."""

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["window_starts"]

# Of a window: 1.2 s are three windows of 0.4 s.
_ROUNDING = 1e-6


def window_starts(times: FloatArray, length: float) -> IntArray:
    """Return the first frame of each window of a take: (W,) int64.

    Parameters
    ----------
    times : (F,) float64 [s]
    length : float [s]
        0 = single frames. A last window of less than half of it belongs to the one before.
    """
    if length == 0.0:
        return np.arange(len(times))
    numbers = np.floor((times - times[0]) / length + _ROUNDING)
    starts = np.unique(numbers, return_index=True)[1]
    rest_is_short = float(times[-1] - times[starts[-1]]) < 0.5 * length
    return starts[:-1] if len(starts) > 1 and rest_is_short else starts
