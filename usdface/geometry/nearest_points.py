"""The nearest of some points to each of them, without the distances of all pairs."""

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray

__all__ = ["nearest_points"]


def nearest_points(points: FloatArray, count: int) -> IntArray:
    """Return for each of points (M, D) the `count` other ones that are nearest: (M, count).

    Fewer where there are not so many.
    """
    count = min(count, len(points) - 1)
    if count < 1:
        return np.zeros((len(points), 0), np.int64)
    near = np.asarray(cKDTree(points).query(points, k=count + 1)[1], np.int64)
    # A point is the nearest to itself; of several at one place it may be any, or none, of these.
    own = near == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True
    return np.asarray(near[~own].reshape(len(points), count))
