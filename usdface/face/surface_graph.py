"""The surface of a mesh as a graph: lengths along its edges, across texture seams."""

import numpy as np
from scipy.sparse import csr_array

from usdface.arrays import IntArray
from usdface.rigs import Mesh

__all__ = ["surface_graph"]


def surface_graph(mesh: Mesh) -> csr_array:
    """Return the lengths of edges and quads' diagonals, vertices split by a texture seam joined.

    Returns
    -------
    (V, V) sparse float64 [m]
        Each edge once.
    """
    if not len(mesh.face_counts):
        return csr_array((len(mesh.points), len(mesh.points)))
    pairs, edges = [], []
    counts, first = mesh.face_counts, np.cumsum(mesh.face_counts) - mesh.face_counts
    for size in np.unique(counts).tolist():
        corners = mesh.face_indices[first[counts == size][:, None] + np.arange(size)]
        edges += [np.stack([corners, np.roll(corners, 1, axis=1)], -1).reshape(-1, 2)]
        if size == 4:
            pairs += [corners[:, [0, 2]], corners[:, [1, 3]]]
    # Files that split vertices along texture seams would tear the skin. A seam has two open edges;
    # a shell over the eye has one too, but the lid that it touches there goes on.
    unique, count = _distinct(np.concatenate(edges), len(mesh.points))
    rim = np.unique(unique[count == 1])
    _, where = np.unique(np.round(mesh.points[rim], 7), axis=0, return_inverse=True)
    order = np.argsort(where.ravel(), kind="stable")
    same = where.ravel()[order][1:] == where.ravel()[order][:-1]
    pairs.append(np.stack([rim[order[1:][same]], rim[order[:-1][same]]], axis=1))
    a, b = _distinct(np.concatenate([unique, *pairs]), len(mesh.points))[0].T
    lengths = np.maximum(np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1), 1e-9)
    size = len(mesh.points)
    # csgraph of SciPy before 1.13 knows no other indices.
    return csr_array((lengths, (a.astype(np.int32), b.astype(np.int32))), shape=(size, size))


def _distinct(pairs: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Return unordered pairs (P, 2) of numbers below `size` once each, and how often they occur."""
    # As one number each they sort several times faster than as rows.
    numbers, count = np.unique(pairs.min(axis=1) * size + pairs.max(axis=1), return_counts=True)
    return np.stack(np.divmod(numbers, size), axis=1), count
