"""Weights by which the residuals of markers colour the skin between them."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from usdface.arrays import FloatArray, IntArray
from usdface.face.surface_graph import surface_graph
from usdface.geometry.marker_spread import marker_spread
from usdface.rigs import Mesh

__all__ = ["heat_of_markers"]

# Markers that colour a vertex, and how far their colour reaches [marker spreads, along the skin].
_NEAREST, _REACH = 4, 0.6
# Distances along the skin that are held at once (160 MB).
_DISTANCES = 20_000_000


def heat_of_markers(mesh: Mesh, vertices: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the markers that colour each vertex (V, K), and their shares (V, K), 0 to 1.

    `vertices` (M,) are those of the markers.

    Residuals spread along the skin, so that the lower lip does not show those of the upper one; far
    from all markers they fade.
    """
    points = mesh.points[vertices]
    count = min(_NEAREST, len(vertices))
    reach = _REACH * (marker_spread(points) if len(points) > 1 else 0.05)
    nearest, distances = _nearest(surface_graph(mesh), vertices, count=count, reach=reach)
    # A marker very near the vertex decides alone.
    shares = np.where(np.isinf(distances), 0.0, (1.0 - distances / reach)) ** 2
    near = shares / np.maximum(np.where(np.isinf(distances), 1.0, distances), 1e-3 * reach)
    total = near.sum(axis=1, keepdims=True)
    weights = np.divide(near, total, out=np.zeros_like(near), where=total > 0)
    return nearest, weights * np.sqrt(shares.max(axis=1, keepdims=True))


def _nearest(
    graph: csr_array, vertices: IntArray, *, count: int, reach: float
) -> tuple[IntArray, FloatArray]:
    """Return the nearest of some vertices to each of a graph, and their distances: (V, count)."""
    size = graph.shape[0]
    nearest = np.zeros((count, size), np.int64)
    distances = np.full((count, size), np.inf)
    at_once = max(1, _DISTANCES // max(size, 1))
    for start in range(0, len(vertices), at_once):
        some = vertices[start : start + at_once]
        away = dijkstra(graph, directed=False, indices=some, limit=reach)
        number = np.broadcast_to(start + np.arange(len(some))[:, None], away.shape)
        both, numbers = np.concatenate([distances, away]), np.concatenate([nearest, number])
        order = np.argsort(both, axis=0, kind="stable")[:count]
        distances = np.take_along_axis(both, order, 0)
        nearest = np.take_along_axis(numbers, order, 0)
    return nearest.T, distances.T
