"""Inbetweens as morph targets of their own, exactly, and back.

UsdSkel's path of a shape is piecewise linear (`usdface.blend_shapes.inbetween_path`). So each
inbetween is a morph target whose weight is a hat over its place, and weights that are linear in
time stay linear between the moments at which they pass an inner place: there a key is inserted.
Since the hats reproduce the line, sum(place * hat) gives the weight back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.inbetween_path import distinct_inbetweens, inbetween_path
from usdface.findings import Finding, finding
from usdface.io.gltf.weld import rows_at
from usdface.rigs import BlendShape, Inbetween, Mesh

__all__ = ["Step", "crossings", "flat_mesh", "flat_weights", "folded", "steps_in"]

_CLOSE = 1e-5  # of a weight: targets that deviate by more were animated separately


@dataclass(frozen=True, slots=True)
class Step:
    """An inbetween `name` at `weight` of the shape at place `shape`; its target's place."""

    shape: int
    name: str
    weight: float
    target: int


def flat_mesh(mesh: Mesh) -> tuple[Mesh, list[dict[str, Any]], list[Finding]]:
    """Return the mesh with a shape for each inbetween, behind the others.

    Returns
    -------
    Mesh
        Without inbetweens; their shapes are named ``shape:inbetween``, made unique.
    list of dict
        For the mesh's extras: which target is an inbetween of which shape, and where.
    list of Finding
        Inbetweens without a place of their own are left out.
    """
    taken = set(mesh.shape_names)
    more: list[BlendShape] = []
    notes: list[dict[str, Any]] = []
    found = []
    for shape in mesh.shapes:
        usable = distinct_inbetweens(shape)
        for between in shape.inbetweens:
            if between not in usable:
                message = "inbetween {inbetween!r} of {shape!r} has no place of its own"
                found.append(
                    finding("INBETWEEN_DROPPED", mesh.name, message, between.name, shape.name)
                )
        for between in usable:
            name, number = f"{shape.name}:{between.name}", 1
            while name in taken:
                number += 1
                name = f"{shape.name}:{between.name}_{number}"
            taken.add(name)
            more.append(BlendShape(name, shape.indices, between.offsets, between.normal_offsets))
            notes.append(
                {"shape": shape.name, "name": between.name, "weight": between.weight}
                | {"target": name}
            )
    plain = tuple(replace(shape, inbetweens=()) for shape in mesh.shapes)
    return replace(mesh, shapes=(*plain, *more)), notes, found


def flat_weights(mesh: Mesh, weights: FloatArray) -> FloatArray:
    """Return the weights (F, T) of the targets of `flat_mesh` for weights (F, S) of `mesh`."""
    primary, more = [], []
    for shape, curve in zip(mesh.shapes, weights.T, strict=True):
        path = inbetween_path(shape)
        hats = path.hats(curve)
        primary.append(hats[:, path.weights == 1][:, 0])
        more.append(hats[:, ~np.isin(path.weights, (0, 1))])  # nothing moves at weight 0
    if not primary:
        return weights
    return np.concatenate([np.stack(primary, 1), *more], 1)


def crossings(mesh: Mesh, times: FloatArray, weights: FloatArray) -> FloatArray:
    """Return when weights (F, S), linear between `times` (F,) [s], pass an inner place."""
    moments = [np.zeros(0)]
    for shape, curve in zip(mesh.shapes, weights.T, strict=True):
        for place in inbetween_path(shape).weights[1:-1].tolist():
            above = curve - place
            k = np.flatnonzero(above[:-1] * above[1:] < 0)
            part = above[k] / (above[k] - above[k + 1])
            moments.append(times[k] + part * (times[k + 1] - times[k]))
    return np.concatenate(moments)


def steps_in(extras: object, names: Sequence[str]) -> tuple[Step, ...] | None:
    """Return the inbetweens that extras name among a mesh's targets; None for nonsense."""
    ours = extras.get("usdface") if isinstance(extras, Mapping) else None
    notes = ours.get("inbetweens") if isinstance(ours, Mapping) else None
    if notes is None:
        return ()
    place = {name: k for k, name in enumerate(names)}
    steps = []
    used: set[tuple[int, float]] = set()
    for note in notes if isinstance(notes, list) else [None]:
        if not isinstance(note, Mapping) or not isinstance(note.get("name"), str):
            return None
        weight = note.get("weight")
        ends = [place.get(n) if isinstance(n := note.get(k), str) else None for k in _ENDS]
        if None in ends or isinstance(weight, bool) or not isinstance(weight, int | float):
            return None
        shape, target = (end for end in ends if end is not None)
        if not np.isfinite(weight) or weight in (0, 1) or (shape, weight) in used:
            return None
        used.add((shape, weight))
        steps.append(Step(shape, note["name"], float(weight), target))
    targets = {step.target for step in steps}
    if len(targets) < len(steps) or targets & {step.shape for step in steps}:
        return None
    return tuple(steps)


_ENDS = ("shape", "target")


def folded(
    mesh: Mesh, steps: Sequence[Step], weights: FloatArray
) -> tuple[Mesh, FloatArray, list[Finding]]:
    """Undo `flat_mesh` and `flat_weights`.

    Returns
    -------
    Mesh
        With inbetweens; unchanged where the weights (F, T) are not those that one weight
        for each shape gives, because something moved the targets on their own.
    weights : (F, S) float64
    list of Finding
    """
    if not steps:
        return mesh, weights, []
    targets = {step.target for step in steps}
    kept = [k for k in range(len(mesh.shapes)) if k not in targets]
    joined = weights.copy()
    for step in steps:
        joined[:, step.shape] += step.weight * weights[:, step.target]
    shapes = tuple(
        _with_inbetweens(
            mesh.shapes[k], [(s, mesh.shapes[s.target]) for s in steps if s.shape == k]
        )
        for k in kept
    )
    result, values = replace(mesh, shapes=shapes), joined[:, kept]
    order = [*kept, *(s.target for k in kept for s in _sorted_steps(steps, k))]
    off = np.abs(flat_weights(result, values) - weights[:, order])
    if (off > _CLOSE * np.maximum(1.0, np.abs(weights[:, order]))).any():
        return mesh, weights, [finding("INBETWEEN_FLAT", mesh.name)]
    return result, values, []


def _sorted_steps(steps: Sequence[Step], shape: int) -> list[Step]:
    return sorted((s for s in steps if s.shape == shape), key=lambda s: s.weight)


def _with_inbetweens(shape: BlendShape, between: Sequence[tuple[Step, BlendShape]]) -> BlendShape:
    if not between:
        return shape
    parts = [shape, *(part for _, part in between)]
    indices = np.unique(np.concatenate([part.indices for part in parts]))

    def spread(part: BlendShape) -> tuple[FloatArray, FloatArray | None]:
        turned = part.normal_offsets
        return rows_at(indices, part.indices, part.offsets), (
            None if turned is None else rows_at(indices, part.indices, turned)
        )

    inbetweens = [Inbetween(step.name, step.weight, *spread(part)) for step, part in between]
    inbetweens.sort(key=lambda b: b.weight)
    return BlendShape(shape.name, indices, *spread(shape), tuple(inbetweens), shape.label)
