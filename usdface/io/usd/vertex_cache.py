"""Points that change over time (vertex caches) as blend shapes, which glTF can hold.

A cache of F samples is a sum of as few blend shapes as show it: they are found one by one, each
from the sample that the others show worst (Gram-Schmidt with pivoting), until none is off by more
than half of the certificate's limit. Between two samples USD moves points straight, as glTF does
weights, so that this holds at any time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.findings import Finding, finding
from usdface.io.unique_name import unique_name
from usdface.rigs import Mesh, Rig
from usdface.takes import WeightsTake

__all__ = [
    "VertexCache",
    "add_cache_shapes",
    "find_vertex_caches",
    "is_cache_shape",
    "points_move",
]

_EXACT = 5e-6  # of the bounding diagonal: half of the certificate's limit
_MOST_SHAPES = 256
_MOST_NUMBERS = 2**28  # of all samples: 1 GiB
_NOWHERE = 1e-9  # of the diagonal: the offset of a point that a shape does not move


@dataclass(frozen=True, eq=False, slots=True)
class VertexCache:
    """The points of one mesh over time.

    Attributes
    ----------
    path : str
        Of the mesh.
    codes : (F,) float64
        Time codes of the samples.
    shapes : tuple of BlendShape, length S
    weights : (F, S) float64
        Between -1 and 1.
    """

    path: str
    codes: FloatArray
    shapes: tuple[BlendShape, ...]
    weights: FloatArray

    def take(self, times: FloatArray) -> WeightsTake:
        """Return the weights at the times [s] of the samples."""
        return WeightsTake(tuple(shape.name for shape in self.shapes), times, self.weights)


def points_move(mesh: UsdGeom.Mesh) -> bool:
    """Whether the points of a mesh change over time."""
    return bool(mesh.GetPointsAttr().ValueMightBeTimeVarying())


def is_cache_shape(mesh: str, shape: str) -> bool:
    """Whether a blend shape of a mesh is named like those of its vertex cache."""
    return shape.startswith(f"{mesh}.points.")


def find_vertex_caches(
    stage: Usd.Stage, rig: Rig, spaces: dict[str, FloatArray]
) -> tuple[tuple[VertexCache, ...], list[Finding]]:
    """Return the vertex caches of a rig's meshes.

    Parameters
    ----------
    stage : Usd.Stage
    rig : Rig
        As `usdface.io.usd.rig.rig_of_stage` reads it off the stage.
    spaces : dict of (4, 4) float64
        From the points of each mesh to rig space, by its path.

    Returns
    -------
    tuple of VertexCache
    list of Finding
        POINTS_TO_SHAPES; FEATURE_APPROXIMATED where not all of the motion is kept,
        ANIMATION_DROPPED where none is.
    """
    caches, found = [], []
    taken = set(rig.shape_names)
    for mesh in rig.meshes:
        points = UsdGeom.Mesh(stage.GetPrimAtPath(mesh.path))
        if not points_move(points):
            continue
        codes = np.array(points.GetPointsAttr().GetTimeSamples(), np.float64)
        moves = _offsets(points, codes, mesh, spaces[mesh.path][:3, :3])
        if isinstance(moves, str):
            found.append(finding("ANIMATION_DROPPED", mesh.path, moves))
            continue
        size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
        parts, weights, error = _decomposed(moves, _EXACT * size)
        shapes = _named_shapes(mesh, parts, _NOWHERE * size, taken)
        caches.append(VertexCache(mesh.path, codes, shapes, weights))
        message = (
            "points in {sample_count} samples became {shape_count} blend shapes, which show them "
            "within {error_mm:.2g} mm"
        )
        counts = len(codes), len(shapes)
        code = "POINTS_TO_SHAPES" if error <= _EXACT * size else "FEATURE_APPROXIMATED"
        more = {} if code == "POINTS_TO_SHAPES" else {"feature": "vertex_cache"}
        found.append(finding(code, mesh.path, message, *counts, 1e3 * error, **more))
        if points.GetNormalsAttr().ValueMightBeTimeVarying():
            message = "its normals over time are left out; they follow the blend shapes"
            found.append(finding("NORMALS_MISSING", mesh.path, message))
    return tuple(caches), found


def _offsets(
    mesh: UsdGeom.Mesh, codes: FloatArray, rest: Mesh, linear: FloatArray
) -> FloatArray | str:
    """Return how far the points are from rest (F, V, 3) [m], float32; or why they are not kept."""
    if len(codes) * rest.points.size > _MOST_NUMBERS:
        return f"its points in {len(codes)} samples are too many; they stay as at the first"
    attribute = mesh.GetPointsAttr()
    start = np.array(attribute.Get(Usd.TimeCode.EarliestTime()), np.float64)
    moves = np.zeros((len(codes), *rest.points.shape), np.float32)
    for row, code in zip(moves, codes.tolist(), strict=True):
        points = np.array(attribute.Get(code), np.float64)
        if points.shape != start.shape:
            return "the number of its points changes over time; they stay as at the first"
        if not np.isfinite(points).all():
            return "its points are no finite numbers at some time; they stay as at the first"
        row[:] = (points - start) @ linear
    return moves


def _decomposed(moves: FloatArray, exact: float) -> tuple[FloatArray, FloatArray, float]:
    """Return parts (S, V, 3) and weights (F, S), and how far off their sum is anywhere [m]."""
    left = moves.reshape(len(moves), -1).copy()
    parts: list[FloatArray] = []
    weights: list[FloatArray] = []
    while True:
        distances = np.sqrt((left.reshape(len(left), -1, 3) ** 2).sum(axis=2).max(axis=1))
        worst = int(distances.argmax())
        if distances[worst] <= exact or len(parts) == min(_MOST_SHAPES, len(left)):
            break
        axis = left[worst] / np.linalg.norm(left[worst])
        along = left @ axis
        left -= np.outer(along, axis)
        most = np.abs(along).max()
        parts.append(axis * most)
        weights.append(along / most)
    shape = (len(parts), *moves.shape[1:])
    error = float(distances.max(initial=0.0))
    return np.array(parts).reshape(shape), np.array(weights).T.reshape(len(moves), -1), error


def _named_shapes(
    mesh: Mesh, parts: FloatArray, nowhere: float, taken: set[str]
) -> tuple[BlendShape, ...]:
    shapes = []
    for number, part in enumerate(parts):
        name = unique_name(f"{mesh.name}.points.{number}", taken)
        taken.add(name)
        shapes.append(BlendShape.from_dense(name, part, tolerance=nowhere))
    return tuple(shapes)


def add_cache_shapes(rig: Rig, caches: Sequence[VertexCache]) -> Rig:
    """Return the rig with the shapes of vertex caches behind those of its meshes."""
    more = {cache.path: cache.shapes for cache in caches}
    meshes = (replace(m, shapes=(*m.shapes, *more.get(m.path, ()))) for m in rig.meshes)
    return replace(rig, meshes=tuple(meshes))
