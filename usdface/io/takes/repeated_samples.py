"""Samples that a file has twice."""

import numpy as np

from usdface.arrays import IntArray

__all__ = ["first_repeat"]


def first_repeat(cells: IntArray) -> int | None:
    """Return the index of a sample whose cell an earlier one has; None if there is none.

    Parameters
    ----------
    cells : (N,) int64
        One number for each pair of a frame and a marker.
    """
    order = np.argsort(cells, kind="stable")
    repeats = np.flatnonzero(np.diff(cells[order]) == 0)
    return int(order[repeats[0] + 1]) if len(repeats) else None
