"""Points that lie far off from all others, as one that was dragged away does."""

import numpy as np

from usdface.takes import BoolArray, FloatArray

__all__ = ["stray_points"]

# Beyond a gap in which the distance from the middle grows by this factor ...
_GAP = 4.0
# ... and no more than this share of the points: more are a part of the thing.
_FEW = 0.05


def stray_points(points: FloatArray) -> BoolArray:
    """Return which of some points (N, 3) lie far off: (N,).

    A few, many times as far from the middle of all (the median) as the farthest of the others.
    """
    none = np.zeros(len(points), dtype=bool)
    few = int(_FEW * len(points))
    if not few:
        return none
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    farthest = np.sort(away)[-few - 1 :]
    gaps = np.flatnonzero(farthest[1:] > _GAP * farthest[:-1])
    if not len(gaps) or not farthest[0] > 0.0:
        return none
    return np.asarray(away > farthest[gaps[0]])
