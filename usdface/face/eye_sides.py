"""Pairs of lids by the side of their eye."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = ["is_left_lid"]

# Largest distance between neighbouring pairs of one eye, as a share of the width of all. The inner
# corners of two human eyes are a third of the outer ones apart.
_ONE_EYE = 0.3


def is_left_lid(points: FloatArray, lids: IntArray) -> BoolArray:
    """Return which pairs belong to the face's left eye, on +X: (P,) bool.

    The middle of all pairs lies between two eyes. Pairs that are close together, on one side of
    the mesh's median, are a single eye.

    Parameters
    ----------
    points : (V, 3) float64
    lids : (P, 2) int64
        Pairs of vertices that touch in closed eyes.
    """
    if not len(lids):
        return np.zeros(0, dtype=bool)
    x = points[lids, 0].mean(axis=1)
    low, high = float(x.min()), float(x.max())
    apart = float(np.diff(np.sort(x)).max(initial=0.0))
    median = float(np.median(points[:, 0]))
    single = apart <= _ONE_EYE * (high - low) and not low <= median <= high
    return np.asarray(x > (median if single else (low + high) / 2))
