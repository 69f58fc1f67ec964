"""Cuts of a hierarchical clustering into a number of clusters."""

import numpy as np
from scipy.cluster.hierarchy import fcluster

from usdface.arrays import FloatArray, IntArray

__all__ = ["clusters"]


def clusters(tree: FloatArray, most: int) -> IntArray:
    """Return the cluster of each of N items, 1 and up: (N,) int64.

    As many clusters as possible, but no more than `most`: merges of equal distance are all cut or
    none. (The criterion `maxclust` of SciPy before 1.15 finds fewer.)

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
