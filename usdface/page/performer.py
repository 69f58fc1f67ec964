"""The performer's markers on a page: placed beside the face, and the heat of their residuals."""

from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from usdface.arrays import FloatArray, IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.surface_graph import surface_graph
from usdface.geometry.marker_spread import marker_spread
from usdface.geometry.rigid_fit import similarity_fit
from usdface.page.packed_data import Quantized
from usdface.retarget_setup import RetargetSetup
from usdface.rigs import Mesh
from usdface.takes import MarkerTake

__all__ = ["heat_of_markers", "markers_on_face", "performer_data"]

# Markers that colour a vertex, and how far their colour reaches [marker spreads, along the skin].
_NEAREST, _REACH = 4, 0.6
# Distances along the skin that are held at once (160 MB).
_DISTANCES = 20_000_000
# Markers further from the face [spreads of its markers] are not shown: spikes of a recording.
_ASTRAY = 20.0


def markers_on_face(
    take: MarkerTake, setup: RetargetSetup, face: BoundFace, head: FloatArray
) -> FloatArray:
    """Return the markers of a take in the space and the size of the face: (F, M, 3) [m].

    A similarity brings the bound markers at rest onto their vertices; NaN = occluded.

    Parameters
    ----------
    take : MarkerTake
    setup : RetargetSetup
    face : BoundFace
        Of the setup.
    head : (F, 4, 4) float64
        Head poses to take out of the motion; (0, 4, 4) = none.
    """
    positions = take.positions
    if take.dimension == 2:
        positions = np.concatenate([positions, np.zeros((*positions.shape[:2], 1))], axis=2)
        positions[..., 2][np.isnan(positions[..., 0])] = np.nan
    elif len(head) == len(positions):
        inverse = np.linalg.inv(head)
        positions = positions @ inverse[:, :3, :3] + inverse[:, None, 3, :3]
    first, last = setup.neutral or (0, 0)
    rest = _mean(positions[first : last + 1])
    bound = [name for name in face.markers if name in take.names]
    columns = [take.names.index(name) for name in bound]
    seen = ~np.isnan(rest[columns]).any(axis=1)
    source = rest[columns][seen]
    target = face.mesh.points[face.vertices_of(bound)][seen]
    if take.dimension == 2:
        target = target * (1.0, 1.0, 0.0)
    if len(source) < 3:
        return _centred(positions, rest, face)
    linear, offset = similarity_fit(source, target)
    placed = positions @ linear + offset
    away = np.linalg.norm(placed - target.mean(axis=0), axis=2)
    return np.where((away > _ASTRAY * marker_spread(target))[..., None], np.nan, placed)


def _mean(positions: FloatArray) -> FloatArray:
    seen = ~np.isnan(positions)
    total = np.where(seen, positions, 0.0).sum(axis=0)
    count = seen.sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _centred(positions: FloatArray, rest: FloatArray, face: BoundFace) -> FloatArray:
    """Return markers at the middle of the face: too few are bound to fit them to it."""
    known = rest[~np.isnan(rest).any(axis=1)]
    middle = face.mesh.points.mean(axis=0)
    return np.asarray(positions - (known.mean(axis=0) if len(known) else 0.0) + middle)


def heat_of_markers(mesh: Mesh, vertices: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the markers that colour each vertex (V, K), and how much each counts (V, K).

    Residuals spread along the skin, so that the lower lip does not show those of the upper one; far
    from all markers they fade.
    """
    points = mesh.points[vertices]
    count = min(_NEAREST, len(vertices))
    reach = _REACH * (marker_spread(points) if len(points) > 1 else 0.05)
    nearest, distances = _nearest(surface_graph(mesh), vertices, count=count, reach=reach)
    # A marker within a hair of the vertex decides alone.
    shares = np.where(np.isinf(distances), 0.0, (1.0 - distances / reach)) ** 2
    near = shares / np.maximum(np.where(np.isinf(distances), 1.0, distances), 1e-3 * reach)
    total = near.sum(axis=1, keepdims=True)
    weights = np.divide(near, total, out=np.zeros_like(near), where=total > 0)
    return nearest, weights * np.sqrt(shares.max(axis=1, keepdims=True))


def _nearest(
    graph: csr_array, vertices: IntArray, *, count: int, reach: float
) -> tuple[IntArray, FloatArray]:
    """Return the nearest of some vertices to each of a graph, and how far they are: (V, count)."""
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


def performer_data(
    take: MarkerTake, positions: FloatArray, face: BoundFace | None
) -> dict[str, Any]:
    """Return names and places of the markers for a page, and which of them are bound."""
    bound = set(face.markers) if face else set()
    return {
        "names": list(take.names),
        "bound": [name in bound for name in take.names],
        "positions": Quantized(positions),
    }
