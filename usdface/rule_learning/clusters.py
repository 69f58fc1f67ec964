"""A hierarchy of groups cut into a number of them."""

import numpy as np
from scipy.cluster.hierarchy import fcluster

from usdface.arrays import FloatArray, IntArray

__all__ = ["clusters"]


def clusters(tree: FloatArray, most: int) -> IntArray:
    """Return the group of each of N things, 1 and up: (N,) int64.

    As many groups as there can be, but no more than `most`: groups equally far apart are parted
    together or not at all. (The criterion `maxclust` of SciPy before 1.15 finds fewer.)

    Parameters
    ----------
    tree : (N - 1, 4) float64
        As `scipy.cluster.hierarchy.linkage` returns it.
    most : int
        1 or more.
    """
    count = len(tree) + 1
    if most >= count:
        return np.arange(1, count + 1)
    limit = float(tree[count - most - 1, 2])
    return np.asarray(fcluster(tree, limit, "distance"), dtype=np.int64)
