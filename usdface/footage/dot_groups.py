"""Two groups of dots far apart, as of two faces that were filmed in one image."""

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from usdface.arrays import FloatArray, IntArray

__all__ = ["dots_far_apart"]

# A face has so many dots at least; fewer are specks, or dots on the clothes.
_LEAST_DOTS = 5
# Least gap between two faces, by the extent of the larger one. Set by hand: dots of one face that
# are only on its brows and mouth lie nearer than the brows are wide.
_APART = 1.0
_MOST_GROUPS = 5  # that the dots are parted into: two faces, and dots beside them


def dots_far_apart(places: FloatArray) -> tuple[IntArray, IntArray, float] | None:
    """Return two groups of dots that lie farther apart than either extends; None without such.

    Groups are those of single linkage: no dot of a group is nearer to the other group than to all
    dots of its own.

    Parameters
    ----------
    places : (M, 2) float64 [px]
        Of the dots of one image; NaN = occluded.

    Returns
    -------
    larger, smaller : (N,) int64
        Indices of the dots of the groups.
    gap : float [px]
        From dot to dot, at the nearest.
    """
    seen = np.flatnonzero(np.isfinite(places).all(axis=1))
    if len(seen) < 2 * _LEAST_DOTS:
        return None
    tree = linkage(places[seen], "single")
    for count in range(2, _MOST_GROUPS + 1):
        labels = fcluster(tree, count, "maxclust")
        groups = sorted((seen[labels == label] for label in np.unique(labels)), key=len)
        smaller, larger = groups[-2:] if len(groups) > 1 else (seen[:0], seen)
        if len(smaller) < _LEAST_DOTS:
            continue
        away = np.linalg.norm(places[larger][:, None] - places[smaller], axis=2)
        extent = max(float(np.ptp(places[own], axis=0).max()) for own in (larger, smaller))
        if away.min() > _APART * extent:
            return larger, smaller, float(away.min())
    return None
