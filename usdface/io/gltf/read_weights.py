"""Weights of glTF, one set per node, as one weight per blend shape name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.gltf.animation_size import check_size
from usdface.io.gltf.frame_rate import chosen_rate, frame_rate
from usdface.io.gltf.inbetweens import Step, folded
from usdface.io.gltf.samplers import Curve
from usdface.rigs import Mesh
from usdface.takes import WeightsTake

__all__ = ["PlacedMesh", "WeightsMotion", "shared_weights"]

_SAME = 1e-6  # of a weight: rounding of equal curves stored as float32


@dataclass(frozen=True, eq=False, slots=True)
class PlacedMesh:
    """A mesh, its node, its weights without animation (S,), and which targets are inbetweens."""

    mesh: Mesh
    node: int
    weights: FloatArray
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class WeightsMotion:
    """How one animation moves weights: a curve by place of a mesh.

    `inserted` are times [s] of keys that an export added for inbetweens; `rate` is the frame rate
    [Hz] that it stated, 0 = none.
    """

    curves: Mapping[int, Curve]
    inserted: FloatArray
    rate: float = 0.0


def shared_weights(
    meshes: Sequence[PlacedMesh], motions: Sequence[WeightsMotion]
) -> tuple[tuple[Mesh, ...], list[WeightsTake | None], list[Finding]]:
    """Give every blend shape of a rig one weight, in all animations.

    glTF gives every node weights of its own, a rig has one weight for each name. Where
    equal names move differently in any animation, the later mesh's shape is renamed
    ``mesh:name``. Inbetweens that were exported as targets are inbetweens again, and keys that
    were inserted for them go. Keys of several curves are united, which changes no curve.

    Returns
    -------
    tuple of Mesh
        The meshes, some shapes renamed.
    list of WeightsTake or None
        For each motion; None where it moves no weights and all are zero.
    list of Finding
    """
    clocks = [
        np.unique(np.concatenate([c.times for c in m.curves.values()])) if m.curves else np.zeros(1)
        for m in motions
    ]
    # All animations one after the other: a name is shared only if it may be in each of them.
    ends = np.cumsum([len(clock) for clock in clocks])
    targets = sum(len(placed.weights) for placed in meshes)
    check_size(int(ends[-1]) * targets, "the animation of weights")
    columns: dict[str, FloatArray] = {}
    renamed = []
    found: list[Finding] = []
    for place, placed in enumerate(meshes):
        values = np.concatenate(
            [
                m.curves[place].at(clock)
                if place in m.curves
                else np.broadcast_to(placed.weights, (len(clock), len(placed.weights)))
                for m, clock in zip(motions, clocks, strict=True)
            ]
        )
        whole, values, new_findings = folded(placed.mesh, placed.steps, values)
        mesh, changed = _merge_curves(whole, values, columns)
        renamed.append(mesh)
        found += new_findings + changed
    takes: list[WeightsTake | None] = []
    still = not any(placed.weights.any() for placed in meshes)
    for motion, clock, end in zip(motions, clocks, ends.tolist(), strict=True):
        if not motion.curves and (still or not columns):
            takes.append(None)
            continue
        weights = np.stack([c[end - len(clock) : end] for c in columns.values()], 1)
        times, weights = _drop_redundant_keys(motion.inserted, clock, weights)
        authored = np.concatenate([np.zeros(0), *(c.keys for c in motion.curves.values())])
        rate = chosen_rate(frame_rate(np.setdiff1d(authored, motion.inserted)), motion.rate)
        takes.append(WeightsTake(tuple(columns), times, weights, rate))
    return tuple(renamed), takes, found


def _drop_redundant_keys(
    inserted: FloatArray, times: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Leave those times out, if the weights are then still the same lines."""
    kept = ~np.isin(times, inserted)
    if kept.all() or not (kept[0] and kept[-1]):
        return times, weights
    lines = np.stack([np.interp(times, times[kept], c) for c in weights[kept].T], 1)
    same = (np.abs(lines - weights) <= _SAME * np.maximum(1.0, np.abs(weights))).all()
    return (times[kept], weights[kept]) if same else (times, weights)


def _merge_curves(
    mesh: Mesh, values: FloatArray, columns: dict[str, FloatArray]
) -> tuple[Mesh, list[Finding]]:
    """Enter a mesh's curves into `columns`; rename shapes whose name is taken by another."""
    found, shapes = [], []
    own: set[str] = set()
    for shape, curve in zip(mesh.shapes, values.T, strict=True):
        name, number = shape.name, 1
        while name in own or (name in columns and not _equal(columns[name], curve)):
            name = f"{mesh.name}:{shape.name}" + (f"_{number}" if number > 1 else "")
            number += 1
        columns[name] = curve
        own.add(name)
        if name != shape.name:
            message = "moves unlike the shape of that name on another mesh; now {name!r}"
            found.append(finding("NAME_CHANGED", shape.name, message, name))
            shape = replace(shape, name=name, label=shape.label or shape.name)
        shapes.append(shape)
    return replace(mesh, shapes=tuple(shapes)), found


def _equal(one: FloatArray, other: FloatArray) -> bool:
    return np.allclose(one, other, rtol=_SAME, atol=_SAME)
