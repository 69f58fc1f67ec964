"""Pictures of a rig at given blend shape weights, in the colours of its materials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.figures.render import View, openness, render
from usdface.geometry.triangulation import triangle_fans
from usdface.materials import Material
from usdface.rigs import Mesh, Rig

__all__ = ["RigTriangles", "face_view", "render_rig", "rig_pictures", "rig_triangles"]

# Quantiles of the moved skin that a view of the face contains, and its height relative to them.
_MIDDLE = (0.03, 0.97)
_MARGIN = 1.7
# The face is where shapes move by at least this [m], and by this share of their largest motion. All
# set by hand.
_LEAST, _SHARED = 1e-3, 0.4
# Faces are nearly the same if no point is farther apart, by the height of the picture.
_ALIKE = 0.005
# Linear colour of faces without a material; opacity below which faces are left out: tear films.
_SKIN = (0.55, 0.42, 0.36)
_CLEAR = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class RigTriangles:
    """All meshes of a rig as one, at N sets of weights.

    Attributes
    ----------
    points : (N, V, 3) float64 [m]
    triangles : (T, 3) int64
    colours : (T, 3) float64
        Linear.
    gloss : (T,) float64
    """

    points: FloatArray
    triangles: IntArray
    colours: FloatArray
    gloss: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "points")
        freeze(self, "triangles", dtype=np.int64)
        freeze(self, "colours", "gloss")


def rig_triangles(rig: Rig, names: Sequence[str], weights: FloatArray) -> RigTriangles:
    """Return a rig at weights (N, S) of the blend shapes `names`; others are 0."""
    columns = {name: column for column, name in enumerate(names)}
    materials = {material.name: material for material in rig.materials}
    points, triangles, colours, gloss, start = [], [], [], [], 0
    for mesh in rig.meshes:
        own = np.zeros((len(weights), len(mesh.shapes)))
        for number, name in enumerate(mesh.shape_names):
            if name in columns:
                own[:, number] = weights[:, columns[name]]
        evaluator, _ = evaluator_of(mesh.shapes, np.arange(len(mesh.points)))
        moved = evaluator.displacements(evaluator.combined(own))
        corners, polygon = triangle_fans(mesh.face_counts)
        used = [materials.get(name) for name in _material_names(mesh)[polygon]]
        shown = np.array([surface is None or surface.opacity >= _CLEAR for surface in used])
        points.append(mesh.points + moved.reshape(len(weights), -1, 3))
        triangles.append(mesh.face_indices[corners[shown]] + start)
        colours.append(np.array([_colour(surface) for surface in used]).reshape(-1, 3)[shown])
        gloss.append(np.array([_gloss(surface) for surface in used])[shown])
        start += len(mesh.points)
    return RigTriangles(
        np.concatenate(points, axis=1),
        np.concatenate(triangles),
        np.concatenate(colours),
        np.concatenate(gloss),
    )


def _material_names(mesh: Mesh) -> NDArray[np.object_]:
    """Return the material of each face."""
    named = np.full(len(mesh.face_counts), mesh.material, dtype=object)
    for subset in mesh.subsets:
        named[subset.faces] = subset.material
    return named


def _colour(material: Material | None) -> tuple[float, float, float]:
    return _SKIN if material is None else material.base_color


def _gloss(material: Material | None) -> float:
    return 0.0 if material is None else 0.9 * max(0.0, 1 - material.roughness) ** 2


def face_view(rig: Rig, size: tuple[int, int]) -> View:
    """Return the view from the front of the part of a rig that its blend shapes move."""
    moved = []
    for mesh in rig.meshes:
        for shape in mesh.shapes:
            length = np.linalg.norm(shape.offsets, axis=1)
            if length.max(initial=0.0) > _LEAST:
                moved.append(mesh.points[shape.indices[length > _SHARED * length.max()]])
    points = np.concatenate(moved or [mesh.points for mesh in rig.meshes])
    low, high = np.quantile(points, _MIDDLE, axis=0)
    width, height = _MARGIN * (high - low)[:2]
    x, y, z = ((low + high) / 2).tolist()
    tall = float(max(height, width * size[1] / size[0]))
    return View(centre=(x, y, z), height=tall, size=size)


def rig_pictures(
    rig: Rig, names: Sequence[str], weights: FloatArray, view: View
) -> list[NDArray[np.uint8]]:
    """Render a rig at weights (N, S): N images (H, W, 3) uint8, sRGB.

    Pictures of nearly the same face have one ambient occlusion.
    """
    shown = rig_triangles(rig, names, weights)
    pictures: list[NDArray[np.uint8]] = []
    skies: list[tuple[FloatArray, FloatArray]] = []
    for points in shown.points:
        apart = (np.abs(points - other).max(initial=0.0) for other, _ in skies)
        same = (n for n, most in enumerate(apart) if most < _ALIKE * view.height)
        known = next(same, len(skies))
        if known == len(skies):
            skies.append((points, openness(points, shown.triangles)))
        sky = skies[known][1]
        pictures.append(render(points, shown.triangles, shown.colours, view, shown.gloss, sky))
    return pictures


def render_rig(rig: Rig, weights: Mapping[str, float], view: View) -> NDArray[np.uint8]:
    """Render a rig at the given weights (shape name to weight): (H, W, 3) uint8, sRGB."""
    at = np.array([list(weights.values())], dtype=np.float64).reshape(1, -1)
    shown = rig_triangles(rig, tuple(weights), at)
    return render(shown.points[0], shown.triangles, shown.colours, view, shown.gloss)
