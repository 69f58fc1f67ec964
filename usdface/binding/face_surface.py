"""The surface of a face that markers can be on, and distances along it.

No marker sits on the eyes, the teeth, the inside of the mouth or the body of a rig. A `FaceSurface`
is the part of the largest connected surface moved by blend shapes that is visible from the front.
Distances run along the surface, because the upper and the lower lip touch
without being near each other.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.geometry.vertex_normals import vertex_normals
from usdface.rigs import Mesh

__all__ = ["MOVING_SHARE", "FaceSurface", "face_surface"]

# The face reaches beyond its moving part by so much of that part's height, to temples and jaw line.
# As the next: set by hand; judge: `python benchmarks/binding.py`; docs/constants.md lists them.
_MARGIN = 0.2
# A vertex that moves by this share of the largest offset belongs to the moving part.
MOVING_SHARE = 0.1
# Cells of the depth images across the face, some 2 mm: narrower than a lip.
_CELLS = 120
# A vertex this many cells behind the foremost sample of its cell is hidden: a surface turned away
# by 63 degrees, atan 2, is that deep in one cell.
_DEPTH = 2.0
# Least cosine between a vertex's normal and a view in which it is visible: 84 degrees.
_FACING = 0.1
# Views of the face, yaw and pitch [degrees]; first those from its own height, which are those of a
# capture volume's cameras.
_VIEWS = ((0, 0), (-50, 0), (50, 0), (0, 45), (0, -45))
_LEVEL = 3


@dataclass(frozen=True, eq=False, slots=True)
class FaceSurface:
    """The part of a mesh that markers can be on.

    Attributes
    ----------
    vertices : (N,) int64
        Of the mesh.
    points : (N, 3) float64 [m]
    offsets : (S, N, 3) float64 [m]
        Of the blend shapes.
    moving : (N,) bool
        Moved by a blend shape by `MOVING_SHARE` of the largest offset or more.
    normals : (N, 3) float64
        Outwards, of length 1.
    level : (N,) bool
        Visible from the height of the face, not from below or above alone.
    graph : (V, V) sparse float64 [m]
        Lengths of the edges and diagonals of the mesh's faces.
    """

    vertices: IntArray
    points: FloatArray
    offsets: FloatArray
    moving: BoolArray
    normals: FloatArray
    level: BoolArray
    graph: csr_array

    def distances(self, vertices: IntArray, limit: float = np.inf) -> FloatArray:
        """Return distances along the surface from vertices of the mesh to its own: (len, N) [m].

        Infinite beyond `limit`.
        """
        unique, back = np.unique(vertices, return_inverse=True)
        far: FloatArray = dijkstra(self.graph, directed=False, indices=unique, limit=limit)
        return far[back][:, self.vertices]


def face_surface(mesh: Mesh) -> FaceSurface:
    """Find the surface of a face that markers can be on.

    Raises
    ------
    InputError
        If the blend shapes move no visible surface.
    """
    triangles, graph = _triangles(mesh), _graph(mesh)
    strength = np.zeros(len(mesh.points))
    for shape in mesh.shapes:
        size = np.linalg.norm(shape.offsets, axis=1)
        strength[shape.indices] = np.maximum(strength[shape.indices], size)
    moving = strength > MOVING_SHARE * strength.max(initial=0.0)
    if not moving.any():
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move nothing; no marker can bind",
            "SKIN_MISSING",
        )
    low, high = mesh.points[moving].min(axis=0), mesh.points[moving].max(axis=0)
    margin = _MARGIN * (high[1] - low[1])
    inside = ((mesh.points > low - margin) & (mesh.points < high + margin)).all(axis=1)
    normals = vertex_normals(mesh.points, np.full(len(triangles), 3), triangles.ravel())
    size = (high - low)[:2].max() + 2 * margin
    views = _seen(mesh.points, triangles, normals, inside, size) & inside
    seen = views.any(axis=0)
    _, part = connected_components(graph, directed=False)
    amount = np.bincount(part, weights=seen * moving)
    vertices = np.flatnonzero(seen & (part == amount.argmax()))
    if amount.max() < 4:
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move no visible surface", "SKIN_MISSING"
        )
    return FaceSurface(
        vertices,
        mesh.points[vertices],
        mesh.offsets_at(vertices),
        moving[vertices],
        normals[vertices],
        views[:_LEVEL, vertices].any(axis=0),
        graph,
    )


def _triangles(mesh: Mesh) -> IntArray:
    """Return the fans of the mesh's faces: (T, 3)."""
    counts = mesh.face_counts
    first = np.repeat(np.cumsum(counts) - counts, np.maximum(counts - 2, 0))
    fans = np.maximum(counts - 2, 0)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    corners = np.stack([first, first + step + 1, first + step + 2], axis=1)
    return np.asarray(mesh.face_indices[corners])


def _graph(mesh: Mesh) -> csr_array:
    """Return the lengths of edges and quads' diagonals, vertices split by a texture seam joined."""
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
    return csr_array((lengths, (a, b)), shape=(size, size))


def _distinct(pairs: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Return unordered pairs (P, 2) of numbers below `size` once each, and how often they occur."""
    # As one number each they sort several times faster than as rows.
    numbers, count = np.unique(pairs.min(axis=1) * size + pairs.max(axis=1), return_counts=True)
    return np.stack(np.divmod(numbers, size), axis=1), count


def _seen(
    points: FloatArray, triangles: IntArray, normals: FloatArray, inside: BoolArray, size: float
) -> BoolArray:
    """Return from which of the views no triangle hides a vertex: (views, V)."""
    used = triangles[inside[triangles].any(axis=1)]
    cell = size / _CELLS
    samples = np.concatenate(list(_samples(points[used], cell))).T.copy()
    seen = []
    for yaw, pitch in _VIEWS:
        turn = _view(yaw, pitch)
        surface, here = turn @ samples, turn @ points.T
        low = np.minimum(surface[:2].min(axis=1), here[:2].min(axis=1))[:, None]
        place = ((surface[:2] - low) / cell).astype(np.int64)
        own = ((here[:2] - low) / cell).astype(np.int64)
        width, height = np.maximum(place.max(axis=1), own.max(axis=1)) + 1
        depth = np.full(width * height, -np.inf)
        np.maximum.at(depth, place[0] + width * place[1], surface[2])
        front = here[2] > depth[own[0] + width * own[1]] - _DEPTH * cell
        seen.append(front & (normals @ turn[2] > _FACING))
    return np.array(seen)


def _view(yaw: float, pitch: float) -> FloatArray:
    """Return the rotation into a view whose z axis points at the camera."""
    a, b = np.radians([yaw, pitch])
    around = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    up = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return np.asarray(up @ around)


def _samples(corners: FloatArray, cell: float) -> Iterator[FloatArray]:
    """Yield points that cover triangles (T, 3, 3) about `cell` apart."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    level = np.ceil(np.log2(np.maximum(longest / cell, 1.0))).astype(np.int64).clip(max=6)
    for split in np.unique(level).tolist():
        steps = 2**split
        i, j = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1))
        keep = (i + j) <= steps
        weights = np.stack([i[keep], j[keep], steps - i[keep] - j[keep]], axis=1) / steps
        yield np.einsum("kc,tcd->tkd", weights, corners[level == split]).reshape(-1, 3)
