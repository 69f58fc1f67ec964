"""The face mesh of a rig, among those with blend shapes, and the part of it that they move."""

from collections.abc import Iterable, Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray, frozen
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.errors import InputError
from usdface.rigs.mesh import Mesh
from usdface.rigs.once_per_mesh import once_per_mesh

__all__ = ["face_of", "faces_like", "largest_offsets", "moved_vertices", "vertex_motion"]

# Share of the shapes of the mesh that has the most: meshes with as many of them are parts of one
# face. Set by hand: a tongue with a dozen shapes beside all 51 of a head shares 0.81 of its shapes
# with it, a beard that only those of jaw, cheeks and mouth move 0.6 of the head's.
_SHARED = 0.75
# What shapes move by less of the motion of the parts (the upper decile of the part that moves most)
# is carried along: a neck, by all shapes of its head. Set by hand: that of a scanned head (ICT) by
# 0.03 in its upper decile.
_CARRIED = 0.1
_ALIKE = 0.9  # of the size of a face's moving part, at least, has another face


def face_of(meshes: Sequence[Mesh], rig: str) -> Mesh:
    """Return the mesh that the most blend shapes move, or a larger one that they move, too.

    `rig` is its name in the error. The reasons are those of `Rig.face`.

    Raises
    ------
    InputError
        If no mesh has any.
    """
    first = max(meshes, key=_face_rank, default=None)
    if first is None or not first.shapes:
        raise InputError(
            f"the rig {rig!r} has no blend shapes; export it with its blend shapes (morph targets)",
            "SHAPES_MISSING",
        )
    shared = _moving_shapes(first)
    parts = [m for m in meshes if len(shared & _moving_shapes(m)) >= _SHARED * len(shared)]
    if len(parts) < 2 or not shared:
        return first
    least = _CARRIED * max(_motion(mesh) for mesh in parts)
    # The face of a whole body moves on average as little as a neck.
    main = max(parts, key=lambda mesh: _moved_size(mesh, least))
    return max((m for m in parts if m is main or _motion(m) >= least), key=_moved_size)


def faces_like(face: Mesh, meshes: Sequence[Mesh]) -> list[Mesh]:
    """Return the face and those of `meshes` that the same shapes move, nearly as large."""
    shapes, least = _moving_shapes(face), _CARRIED * _motion(face)
    if not shapes:
        return [face]
    size = _ALIKE * _moved_size(face)
    return [
        mesh
        for mesh in meshes
        if mesh is face
        or (shapes == _moving_shapes(mesh) and _motion(mesh) >= least and _moved_size(mesh) >= size)
    ]


def _face_rank(mesh: Mesh) -> tuple[int, int, float]:
    return len(_moving_shapes(mesh)), len(mesh.shapes), _moved_size(mesh)


def _motion(mesh: Mesh) -> float:
    """Return the largest offset of the moving vertices of a mesh, their upper decile [m]."""
    offsets = largest_offsets(mesh)
    return float(np.quantile(offsets[offsets > 0], 0.9)) if offsets.any() else 0.0


def _moved_size(mesh: Mesh, least: float = 0.0) -> float:
    """Return the diagonal of the box around points that blend shapes move by over `least` [m]."""
    moved = largest_offsets(mesh) > least
    return float(np.linalg.norm(np.ptp(mesh.points[moved], axis=0))) if moved.any() else 0.0


def vertex_motion(shapes: Iterable[BlendShape], count: int) -> FloatArray:
    """Return the motion of each of `count` vertices of a mesh by its shapes, 0 to 1: (count,).

    The largest squared offset of any shape, each divided by the largest of that shape.
    """
    motion = np.zeros(count)
    for shape in shapes:
        squares = (shape.offsets**2).sum(axis=1)
        if squares.any():
            np.maximum.at(motion, shape.indices, squares / squares.max())
    return motion


@once_per_mesh
def largest_offsets(mesh: Mesh) -> FloatArray:
    """Return the length of the largest offset of each vertex by a blend shape: (V,) [m]."""
    largest = np.zeros(len(mesh.points))
    for shape in mesh.shapes:
        length = np.linalg.norm(shape.offsets, axis=1)
        largest[shape.indices] = np.maximum(largest[shape.indices], length)
    return frozen(largest)


def moved_vertices(mesh: Mesh) -> BoolArray:
    """Return the vertices that a blend shape at weight 1 moves: (V,)."""
    return np.asarray(largest_offsets(mesh) > 0)


def _moving_shapes(mesh: Mesh) -> set[str]:
    """Return the blend shapes of a mesh that move something, inbetweens included."""
    return {
        s.name
        for s in mesh.shapes
        if s.offsets.any() or any(between.offsets.any() for between in s.inbetweens)
    }
