"""Linear interpolation of occluded markers in time."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray

__all__ = ["interpolate_gaps"]


def interpolate_gaps(values: FloatArray, occluded: BoolArray, times: FloatArray) -> FloatArray:
    """Fill the gaps of each column by straight lines in time; constant beyond the first and last.

    Parameters
    ----------
    values : (F, N) float64
    occluded : (F, N) bool
        Where there is a gap. Columns without any value stay as they are.
    times : (F,) float64
        Strictly increasing, in any unit.

    Returns
    -------
    (F, N) float64
    """
    filled = values.copy()
    for column in np.flatnonzero(occluded.any(axis=0) & ~occluded.all(axis=0)):
        gap = occluded[:, column]
        filled[gap, column] = np.interp(times[gap], times[~gap], values[~gap, column])
    return filled
