"""The mean of values of which some are missing."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["seen_mean"]


def seen_mean(values: FloatArray) -> FloatArray:
    """Return the mean over the first axis of the values that are not NaN; NaN where all are.

    Unlike `numpy.nanmean` without a warning there.
    """
    count = (~np.isnan(values)).sum(axis=0)
    return np.where(count > 0, np.nansum(values, axis=0) / np.maximum(count, 1), np.nan)
