"""Vertices that agree in everything become one."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray
from usdface.numerics.matching_rows import matching_rows

__all__ = ["Rows", "rows_at", "weld_vertices"]

Rows = tuple[IntArray, FloatArray]  # some vertices, increasing, and their offsets (N, 3)


def weld_vertices(
    points: FloatArray, columns: list[NDArray[Any]], rows: Iterable[Rows]
) -> tuple[IntArray, IntArray]:
    """Find the vertices that are equal in position, in all columns, and in all offsets.

    Parameters
    ----------
    points : (V, 3) float64
    columns : list of (V, K) arrays
        Other attributes, dense.
    rows : iterable of Rows
        Offsets of blend shapes, sparse; taken one at a time.

    Returns
    -------
    first : (N,) int64
        The first vertex of each group of equal ones, increasing.
    of_vertex : (V,) int64
        The group of each vertex, as a place in `first`.
    """
    group, alone = _groups(points)
    label = np.arange(len(points))
    suspects = np.flatnonzero(~alone[group])  # only these share their position
    if len(suspects):
        traits = [group[suspects, None].astype(np.float64)]
        traits += [column[suspects] for column in columns]
        traits += [rows_at(suspects, *r) for r in rows]
        same, _ = _groups(np.concatenate(traits, 1))
        leader = np.full(same.max() + 1, len(points))
        np.minimum.at(leader, same, suspects)
        label[suspects] = leader[same]
    first, of_vertex = np.unique(label, return_inverse=True)
    return first, of_vertex


def _groups(values: FloatArray) -> tuple[IntArray, NDArray[np.bool_]]:
    """Return a group number for each row, equal rows alike, and whether a group has one row."""
    rows = np.ascontiguousarray(values + 0.0)  # -0 and 0 are equal, their bytes are not
    keys = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, group, count = np.unique(keys, return_inverse=True, return_counts=True)
    return group, count == 1


def rows_at(vertices: IntArray, indices: IntArray, offsets: FloatArray) -> FloatArray:
    """Return the sparse `offsets` of `indices` at some vertices: (len(vertices), 3)."""
    result = np.zeros((len(vertices), 3))
    where, rows = matching_rows(indices, vertices)
    result[where] = offsets[rows]
    return result
