"""The surface of a mesh as a graph: lengths along its edges, across texture seams."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from usdface.arrays import IntArray
from usdface.rigs import Mesh

__all__ = ["joined_at_seams", "surface_graph"]

# Blend shapes move both sides of a texture seam alike, up to the rounding of files [m].
_TOGETHER = 1e-5


def surface_graph(mesh: Mesh) -> csr_array:
    """Return the lengths of edges and of quads' diagonals; vertices split at seams are joined.

    Returns
    -------
    (V, V) sparse float64 [m]
        Each edge once.
    """
    if not len(mesh.face_counts):
        return csr_array((len(mesh.points), len(mesh.points)))
    edges, diagonals = _edges(mesh)
    pairs = np.concatenate([edges, diagonals, _seams(mesh, edges)])
    a, b = _distinct(pairs, len(mesh.points))[0].T
    lengths = np.maximum(np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1), 1e-9)
    size = len(mesh.points)
    # csgraph of SciPy before 1.13 knows no other indices.
    return csr_array((lengths, (a.astype(np.int32), b.astype(np.int32))), shape=(size, size))


def joined_at_seams(mesh: Mesh) -> IntArray:
    """Return, for each vertex, one common to all that a texture seam split from it: (V,) int64."""
    seams = _seams(mesh, _edges(mesh)[0])
    size = len(mesh.points)
    graph = csr_array((np.ones(len(seams)), seams.T.astype(np.int32)), shape=(size, size))
    _, component = connected_components(graph, directed=False)
    return np.asarray(np.unique(component, return_index=True)[1][component])


def _edges(mesh: Mesh) -> tuple[IntArray, IntArray]:
    """Return the vertices of all faces' edges, and of quads' diagonals: (E, 2), (D, 2)."""
    none = np.zeros((0, 2), np.int64)
    edges, diagonals = [none], [none]
    counts, first = mesh.face_counts, np.cumsum(mesh.face_counts) - mesh.face_counts
    for size in np.unique(counts).tolist():
        corners = mesh.face_indices[first[counts == size][:, None] + np.arange(size)]
        edges.append(np.stack([corners, np.roll(corners, 1, axis=1)], -1).reshape(-1, 2))
        if size == 4:
            diagonals += [corners[:, [0, 2]], corners[:, [1, 3]]]
    return np.concatenate(edges), np.concatenate(diagonals)


def _seams(mesh: Mesh, edges: IntArray) -> IntArray:
    """Return pairs of vertices that a texture seam splits: (N, 2)."""
    # Files that split vertices along texture seams would tear the skin. A seam has two open edges;
    # a shell over the eye has one too, but the lid that it touches there goes on.
    unique, count = _distinct(edges, len(mesh.points))
    rim = np.unique(unique[count == 1])
    _, where = np.unique(np.round(mesh.points[rim], 7), axis=0, return_inverse=True)
    order = np.argsort(where.ravel(), kind="stable")
    same = where.ravel()[order][1:] == where.ravel()[order][:-1]
    pairs = np.stack([rim[order[1:][same]], rim[order[:-1][same]]], axis=1)
    # Lips that touch at rest have two open edges, too, but part.
    one, other = (mesh.offsets_at(pairs[:, k]) for k in (0, 1))
    apart = np.linalg.norm(one - other, axis=2).max(axis=0, initial=0.0)
    return np.asarray(pairs[apart <= _TOGETHER])


def _distinct(pairs: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Return unordered pairs (P, 2) of numbers below `size` once each, and how often they occur."""
    # As one number each they sort several times faster than as rows.
    numbers, count = np.unique(pairs.min(axis=1) * size + pairs.max(axis=1), return_counts=True)
    return np.stack(np.divmod(numbers, size), axis=1), count
