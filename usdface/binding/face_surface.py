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
from usdface.face.surface_graph import surface_graph
from usdface.geometry.stray_points import stray_points
from usdface.geometry.triangulation import triangle_fans
from usdface.geometry.vertex_areas import vertex_areas
from usdface.geometry.vertex_normals import triangle_normals
from usdface.geometry.view_rotation import view_rotation
from usdface.rigs import Mesh
from usdface.rigs.face_mesh import largest_offsets

__all__ = ["MOVING_SHARE", "FaceSurface", "face_surface"]

# The face reaches beyond its moving part by so much of that part's height, to temples and jaw line.
# As the next: set by hand; judge: `python benchmarks/binding.py`; docs/constants.md lists them.
_MARGIN = 0.2
# A vertex that moves by this share of the largest offset belongs to the moving part.
MOVING_SHARE = 0.1
# A vertex that moves so many times as far as any neighbour, and as all that move with theirs, is
# torn off: no marker sits there, and it does not count for the largest offset. Set by hand: on a
# face mesh neighbours move alike.
_TORN = 5.0
# Cells of the depth images across the face, some 2 mm: narrower than a lip; and at most along the
# diagonal of its bounding box, which bounds the memory on a face that is deeper than wide.
_CELLS, _MOST_CELLS = 120, 480
# Samples of triangles in a depth image, of larger triangles fewer are taken before there are more;
# samples held at once; times that an edge is halved at most. They bound memory and time.
_SAMPLES, _AT_ONCE, _FINEST = 2_000_000, 200_000, 6
# Distances along the surface held at once (160 MB).
_DISTANCES = 20_000_000
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
    mesh : Mesh
    vertices : (N,) int64
        Of the mesh.
    points : (N, 3) float64 [m]
    moving : (N,) bool
        Moved by a blend shape by `MOVING_SHARE` of the largest offset or more.
    normals : (N, 3) float64
        Outwards, of length 1.
    areas : (N,) float64 [m²]
        Of the surface around each vertex.
    level : (N,) bool
        Visible from the height of the face, not from below or above alone.
    torn : (V,) bool
        Vertices of the mesh that a blend shape tears off the surface.
    graph : (V, V) sparse float64 [m]
        Lengths of the edges and diagonals of the mesh's faces.
    """

    mesh: Mesh
    vertices: IntArray
    points: FloatArray
    moving: BoolArray
    normals: FloatArray
    areas: FloatArray
    level: BoolArray
    torn: BoolArray
    graph: csr_array

    def offsets_at(self, indices: IntArray) -> FloatArray:
        """Return the offsets of the blend shapes at vertices of the surface: (S, len, 3) [m]."""
        return self.mesh.offsets_at(self.vertices[indices])

    def distances(self, vertices: IntArray, limit: float = np.inf) -> FloatArray:
        """Return distances along the surface from vertices of the mesh to its own: (len, N) [m].

        Infinite beyond `limit`.
        """
        unique, back = np.unique(vertices, return_inverse=True)
        some = max(1, _DISTANCES // self.graph.shape[0])  # dijkstra fills in all of the mesh
        far = [
            dijkstra(self.graph, directed=False, indices=unique[k : k + some], limit=limit)[
                :, self.vertices
            ]
            for k in range(0, len(unique), some)
        ]
        return np.asarray(np.concatenate(far)[back])


def face_surface(mesh: Mesh) -> FaceSurface:
    """Find the surface of a face that markers can be on.

    Raises
    ------
    InputError
        If the blend shapes move no visible surface.
    """
    triangles = mesh.face_indices[triangle_fans(mesh.face_counts)[0]]
    graph = surface_graph(mesh)
    strength = largest_offsets(mesh)
    torn = _torn(strength, graph)
    moving: BoolArray = (strength > MOVING_SHARE * strength[~torn].max(initial=0.0)) & ~torn
    if not moving.any():
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move nothing; no marker can bind",
            "SKIN_MISSING",
        )
    face = mesh.points[moving]
    face = face[~stray_points(face)]
    low, high = face.min(axis=0), face.max(axis=0)
    margin = _MARGIN * (high[1] - low[1])
    inside = ((mesh.points > low - margin) & (mesh.points < high + margin)).all(axis=1)
    normals = triangle_normals(mesh.points, triangles)
    box = high - low + 2 * margin
    cell = max(float(box[:2].max()) / _CELLS, float(np.linalg.norm(box)) / _MOST_CELLS)
    views = _seen(mesh.points, triangles, normals, inside & ~torn, cell)
    seen = views.any(axis=0)
    _, part = connected_components(graph, directed=False)
    amount = np.bincount(part, weights=seen * moving)
    vertices = np.flatnonzero(seen & (part == amount.argmax()))
    if amount.max() < 4:
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move no surface visible from the front; "
            'name the mesh of the face in the binding, "mesh"',
            "SKIN_MISSING",
        )
    return FaceSurface(
        mesh=mesh,
        vertices=vertices,
        points=mesh.points[vertices],
        moving=moving[vertices],
        normals=normals[vertices],
        areas=vertex_areas(mesh.points, triangles)[vertices],
        level=np.asarray(views[:_LEVEL, vertices].any(axis=0)),
        torn=torn,
        graph=graph,
    )


def _torn(strength: FloatArray, graph: csr_array) -> BoolArray:
    """Return which vertices some shape tears off the surface, by how far they are moved: (V,)."""
    a, b = graph.nonzero()
    others = np.zeros(len(strength))
    np.maximum.at(others, a, strength[b])
    np.maximum.at(others, b, strength[a])
    usual = float(strength[strength <= _TORN * others].max(initial=0.0))
    torn: BoolArray = strength > _TORN * np.maximum(others, usual)
    return torn if usual > 0.0 else np.zeros_like(torn)


def _seen(
    points: FloatArray, triangles: IntArray, normals: FloatArray, inside: BoolArray, cell: float
) -> BoolArray:
    """Return from which of the views no triangle hides a vertex of those `inside`: (views, V)."""
    seen = np.zeros((len(_VIEWS), len(points)), dtype=bool)
    if not (inside.any() and cell > 0):
        return seen
    turns = [view_rotation(yaw, pitch) for yaw, pitch in _VIEWS]
    here = [turn @ points[inside].T for turn in turns]
    # The images end where the face does: points beyond hide nothing of it.
    lows = [one[:2].min(axis=1, keepdims=True) for one in here]
    sizes = [_cells(one, low, cell).max(axis=1) + 1 for one, low in zip(here, lows, strict=True)]
    depths = [np.full(size.prod(), -np.inf) for size in sizes]
    for samples in _samples(points[triangles[inside[triangles].any(axis=1)]], cell):
        for turn, low, size, depth in zip(turns, lows, sizes, depths, strict=True):
            surface = turn @ samples.T
            there = surface[:2] - low
            shown = ((there >= 0) & (there < cell * size[:, None])).all(axis=0)
            place = _cells(surface[:, shown], low, cell).clip(max=size[:, None] - 1)
            np.maximum.at(depth, place[0] + size[0] * place[1], surface[2, shown])
    for row, turn, own, low, size, depth in zip(
        seen, turns, here, lows, sizes, depths, strict=True
    ):
        place = _cells(own, low, cell)
        front = own[2] > depth[place[0] + size[0] * place[1]] - _DEPTH * cell
        row[inside] = front & (normals[inside] @ turn[2] > _FACING)
    return seen


def _cells(points: FloatArray, low: FloatArray, cell: float) -> IntArray:
    """Return the cell (2, N) of an image in which each of some points (3, N) is."""
    return np.asarray((points[:2] - low) / cell, dtype=np.int64)


def _samples(corners: FloatArray, cell: float) -> Iterator[FloatArray]:
    """Yield points that cover triangles (T, 3, 3) about `cell` apart, some (N, 3) at a time."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    level = np.ceil(np.log2(np.maximum(longest / cell, 1.0))).clip(max=_FINEST).astype(np.int64)
    steps = 2 ** np.arange(_FINEST + 1)
    each = (steps + 1) * (steps + 2) // 2
    while level.any() and each[level].sum() > _SAMPLES:
        level = level.clip(max=level.max() - 1)
    for split in np.unique(level).tolist():
        i, j = np.meshgrid(np.arange(steps[split] + 1), np.arange(steps[split] + 1))
        keep = (i + j) <= steps[split]
        weights = np.stack([i[keep], j[keep], steps[split] - i[keep] - j[keep]], axis=1)
        own, count = corners[level == split], max(1, _AT_ONCE // len(weights))
        for k in range(0, len(own), count):
            some = np.einsum("kc,tcd->tkd", weights / steps[split], own[k : k + count])
            yield some.reshape(-1, 3)
