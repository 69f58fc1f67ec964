"""Rows of a sparse array by their index."""

import numpy as np

from usdface.arrays import IntArray

__all__ = ["matching_rows"]


def matching_rows(indices: IntArray, wanted: IntArray) -> tuple[IntArray, IntArray]:
    """Return where in `wanted` (N,) one of `indices` (K,) occurs, and its row in `indices`.

    `indices` increase; `wanted` may be in any order, and repeated.
    """
    if not len(indices):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    rows = np.searchsorted(indices, wanted).clip(max=len(indices) - 1)
    where = np.flatnonzero(indices[rows] == wanted)
    return where, rows[where]
