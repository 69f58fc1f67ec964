"""Checks of the blend shapes of a mesh: see `usdface.io.usd.check`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdSkel

from usdface.findings import Finding, finding
from usdface.geometry.stray_points import stray_move
from usdface.io.usd.blend_shapes import blend_shape_at
from usdface.io.usd.value_arrays import vectors_of

__all__ = ["check_shapes", "finite_points", "names_and_targets", "shapes_of"]

Findings = Iterator[Finding]
_START = Usd.TimeCode.EarliestTime()


@dataclass(frozen=True, eq=False, slots=True)
class _Shape:
    """A blend shape of a mesh with `count` points, as authored.

    `points` are those of the mesh, none where one is no number. `vectors` holds offsets and normal
    offsets by attribute, those of inbetweens included; `inbetweens` their weights.
    """

    where: str
    count: int
    points: NDArray[np.float64]
    indices: NDArray[np.int64]
    vectors: dict[str, NDArray[np.float64]]
    inbetweens: dict[str, float | None]


def names_and_targets(prim: Usd.Prim) -> tuple[list[str], list[object]]:
    """Return the names of a mesh's blend shapes, and the prims that are their targets."""
    binding = UsdSkel.BindingAPI(prim)
    relation = binding.GetBlendShapeTargetsRel()
    names = [str(name) for name in binding.GetBlendShapesAttr().Get() or ()]
    return names, list(relation.GetForwardedTargets()) if relation else []


def finite_points(prim: Usd.Prim) -> NDArray[np.float64]:
    """Return the points of a mesh; none where one of them is no number."""
    points = vectors_of(UsdGeom.Mesh(prim).GetPointsAttr().Get(_START))
    return points if np.isfinite(points).all() else np.zeros((0, 3))


def shapes_of(prim: Usd.Prim) -> list[UsdSkel.BlendShape]:
    """Return the blend shapes of a mesh that exist, each once."""
    targets = dict.fromkeys(names_and_targets(prim)[1])
    shapes = (blend_shape_at(prim.GetStage(), target) for target in targets)
    return [shape for shape in shapes if shape]


def check_shapes(prim: Usd.Prim) -> Findings:
    """Yield the faults of the blend shapes of a mesh."""
    for shape in _shapes(prim):
        for rule in _SHAPE_RULES:
            yield from rule(shape)


def _shapes(prim: Usd.Prim) -> Iterator[_Shape]:
    count = len(UsdGeom.Mesh(prim).GetPointsAttr().Get(_START) or ())
    points = finite_points(prim)
    for shape in shapes_of(prim):
        indices = np.asarray(shape.GetPointIndicesAttr().Get() or [], np.int64)
        vectors = {
            "offsets": vectors_of(shape.GetOffsetsAttr().Get()),
            "normalOffsets": vectors_of(shape.GetNormalOffsetsAttr().Get()),
        }
        inbetweens: dict[str, float | None] = {}
        for between in shape.GetAuthoredInbetweens():
            name = between.GetAttr().GetName()
            inbetweens[name] = between.GetWeight()
            vectors[name] = vectors_of(between.GetOffsets())
            vectors[f"{name}:normalOffsets"] = vectors_of(between.GetNormalOffsets())
        yield _Shape(str(shape.GetPath()), count, points, indices, vectors, inbetweens)


def _indices_are_inside(shape: _Shape) -> Findings:
    outside = shape.indices[(shape.indices < 0) | (shape.indices >= shape.count)]
    if len(outside):
        message = "point index {point} on a mesh of {point_count} points"
        yield finding("POINT_INDICES_OUTSIDE", shape.where, message, outside[0], shape.count)


def _indices_are_sorted(shape: _Shape) -> Findings:
    if (np.diff(shape.indices) < 0).any():
        yield finding("POINT_INDICES_UNSORTED", shape.where)


def _indices_are_unique(shape: _Shape) -> Findings:
    if len(np.unique(shape.indices)) < len(shape.indices):
        yield finding("POINT_INDICES_REPEATED", shape.where)


def _lengths_agree(shape: _Shape) -> Findings:
    expected = len(shape.indices) or shape.count
    for name, values in shape.vectors.items():
        if len(values) not in (0, expected):
            message = "{value_count} {attribute} for {expected_count} points"
            yield finding("OFFSETS_LENGTH_WRONG", shape.where, message, len(values), name, expected)


def _offsets_are_finite(shape: _Shape) -> Findings:
    for name, values in shape.vectors.items():
        if not np.isfinite(values).all():
            yield finding(
                "VALUES_WRONG", shape.where, "{attribute} holds NaN or infinite numbers", name
            )


def _offsets_are_near(shape: _Shape) -> Findings:
    for name, values in shape.vectors.items():
        if name.endswith("normalOffsets") or not np.isfinite(values).all():
            continue
        indices = shape.indices if len(shape.indices) == len(values) else np.arange(len(values))
        stray = stray_move(values, indices, shape.points)
        if stray:
            message, *found = stray
            yield finding("POINT_STRAY", shape.where, "{attribute}: " + message, name, *found)


def _moves_something(shape: _Shape) -> Findings:
    if not any(values.any() for values in shape.vectors.values()):
        yield finding("SHAPE_EMPTY", shape.where)


def _inbetweens_have_places(shape: _Shape) -> Findings:
    used: dict[float, str] = {0.0: "neutral", 1.0: "the shape itself"}
    for name, weight in shape.inbetweens.items():
        if not isinstance(weight, float) or not np.isfinite(weight):
            message = "{inbetween} has the weight {weight}; author a number"
            yield finding("INBETWEEN_WRONG", shape.where, message, name, weight)
        elif weight in used:
            message = "{inbetween} has the weight {weight:g}, where {other} is"
            yield finding("INBETWEEN_WRONG", shape.where, message, name, weight, used[weight])
        else:
            used[weight] = name


_SHAPE_RULES: tuple[Callable[[_Shape], Findings], ...] = (
    _indices_are_inside,
    _indices_are_sorted,
    _indices_are_unique,
    _lengths_agree,
    _offsets_are_finite,
    _offsets_are_near,
    _moves_something,
    _inbetweens_have_places,
)
