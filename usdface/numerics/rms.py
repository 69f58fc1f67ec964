"""The root mean square of values, some of which may be missing."""

from typing import overload

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["rms"]


@overload
def rms(values: FloatArray, axis: None = None, *, empty: float = 0.0) -> float: ...
@overload
def rms(values: FloatArray, axis: int, *, empty: float = 0.0) -> FloatArray: ...
def rms(values: FloatArray, axis: int | None = None, *, empty: float = 0.0) -> float | FloatArray:
    """Return the root mean square of the values that are not NaN, in their own unit.

    Parameters
    ----------
    values : (...) float64
        NaN = missing.
    axis : int, optional
        The axis that the mean is taken over; all, if left out.
    empty : float
        The answer where no value is there.

    Returns
    -------
    float or float64
        `values` without `axis`.

    Examples
    --------
    >>> bool(rms(np.array([3.0, np.nan, -4.0])) == np.sqrt(12.5))
    True
    """
    there = ~np.isnan(values)
    squares = np.where(there, values, 0.0) ** 2
    counts = np.asarray(there.sum(axis=axis))
    means = squares.sum(axis=axis) / np.maximum(counts, 1)
    found = np.where(counts > 0, np.sqrt(means), empty)
    return float(found) if axis is None else np.asarray(found)
