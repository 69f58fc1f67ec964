"""Weights animation of glTF as a take.

Source: glTF 2.0 specification, section 3.11 and appendix C (interpolation).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pygltflib import Animation, AnimationSampler

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.document import item
from usdface.io.gltf.inbetweens import Step, folded
from usdface.rigs import Mesh
from usdface.takes import FloatArray, WeightsTake

__all__ = ["PlacedMesh", "weights_take"]

_SAME = 1e-6  # of a weight: what float32 leaves of equal curves
_TOLERANCE = 1e-4  # of a weight, where cubic curves become lines
_MOST_PARTS = 256  # lines for one cubic segment


@dataclass(frozen=True, eq=False, slots=True)
class PlacedMesh:
    """A mesh, its node, its weights without animation (S,), and which targets are inbetweens."""

    mesh: Mesh
    node: int
    weights: FloatArray
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class _Curve:
    """Piecewise linear weights: `times` (K,) [s], `values` (K, S)."""

    times: FloatArray
    values: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        if np.array_equal(times, self.times):
            return self.values
        return np.stack([np.interp(times, self.times, column) for column in self.values.T], 1)


def weights_take(
    animations: Sequence[Animation], meshes: Sequence[PlacedMesh], reader: AccessorReader
) -> tuple[tuple[Mesh, ...], WeightsTake | None, list[Finding]]:
    """Return the first animation of weights as a take over the blend shapes of all meshes.

    glTF gives every node weights of its own, a rig has one weight for each name. Where
    equal names move differently, the later mesh's shape is renamed ``mesh:name``. Steps
    become two keys one float32 apart; cubic curves become lines within 1e-4. Inbetweens that
    were exported as targets are inbetweens again, and keys that were inserted for them go. Keys of
    several curves are united, which changes no curve. Without animation, weights that are
    not zero become a take of one frame.

    Parameters
    ----------
    animations : of pygltflib
    meshes : sequence of PlacedMesh
    reader : AccessorReader

    Returns
    -------
    tuple of Mesh
        The meshes, some shapes renamed.
    WeightsTake or None
        None where no weights are animated and all are zero.
    list of Finding

    Raises
    ------
    InputError
        If the animation's times, interpolation or number of values are not as they must be.
    """
    animation, chosen, curves, found = _first_curves(animations, meshes, reader)
    times = np.zeros(1)
    if curves:
        times = np.unique(np.concatenate([curve.times for curve in curves.values()]))
    columns: dict[str, FloatArray] = {}
    renamed = []
    for place, placed in enumerate(meshes):
        still = np.broadcast_to(placed.weights, (len(times), len(placed.weights)))
        values = curves[place].at(times) if place in curves else still
        whole, values, news = folded(placed.mesh, placed.steps, values)
        mesh, changed = _shared(whole, values, columns)
        renamed.append(mesh)
        found += news + changed
    if not curves and not any(placed.weights.any() for placed in meshes):
        return tuple(renamed), None, found
    weights = np.stack(list(columns.values()), 1)
    times, weights = _without(_inserted(animation, curves), times, weights)
    take = WeightsTake(tuple(columns), times, weights, _rate(times), source=chosen)
    return tuple(renamed), take, found


def _inserted(animation: Animation | None, curves: Mapping[int, _Curve]) -> FloatArray:
    """Return the times [s] of keys that were inserted where weights pass inbetweens."""
    extras = animation.extras if animation is not None else None
    ours = extras.get("usdface") if isinstance(extras, Mapping) else None
    keys = ours.get("insertedKeys") if isinstance(ours, Mapping) else None
    if not isinstance(keys, list) or not all(type(key) is int for key in keys):
        return np.zeros(0)
    inserted = [c.times[[k for k in keys if 0 <= k < len(c.times)]] for c in curves.values()]
    return np.concatenate([np.zeros(0), *inserted])


def _without(
    inserted: FloatArray, times: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Leave those times out, if the weights are then still the same lines."""
    kept = ~np.isin(times, inserted)
    if kept.all() or not (kept[0] and kept[-1]):
        return times, weights
    lines = np.stack([np.interp(times, times[kept], c) for c in weights[kept].T], 1)
    same = (np.abs(lines - weights) <= _SAME * np.maximum(1.0, np.abs(weights))).all()
    return (times[kept], weights[kept]) if same else (times, weights)


def _first_curves(
    animations: Sequence[Animation], meshes: Sequence[PlacedMesh], reader: AccessorReader
) -> tuple[Animation | None, str, dict[int, _Curve], list[Finding]]:
    """Return the animation, its name, a curve for each mesh that it moves, and losses."""
    found: list[Finding] = []
    curves: dict[int, _Curve] = {}
    chosen, found_in = "", None
    place_of = {m.node: place for place, m in enumerate(meshes) if m.mesh.shapes}
    for number, animation in enumerate(animations):
        name = animation.name or f"animation {number}"
        channels = [
            (place_of[c.target.node], item(animation.samplers, c.sampler, "animation sampler"))
            for c in animation.channels
            if c.target is not None and c.target.path == "weights" and c.target.node in place_of
        ]
        if curves or not channels:
            found.append(finding("ANIMATION_DROPPED", name))
            continue
        chosen, found_in = name, animation
        if len(channels) < len(animation.channels):
            message = "channels that move no blend shape were left out"
            found.append(finding("ANIMATION_DROPPED", name, message))
        for place, sampler in channels:
            if place in curves:
                raise InputError(f"{name!r} moves the weights of one node twice")
            curves[place], changed = _curve(sampler, meshes[place].mesh, name, reader)
            found += changed
    return found_in, chosen, curves, found


def _curve(
    sampler: AnimationSampler, mesh: Mesh, name: str, reader: AccessorReader
) -> tuple[_Curve, list[Finding]]:
    times = reader.floats(sampler.input, "SCALAR")[:, 0]
    if (np.diff(times) <= 0).any():
        raise InputError(f"the times of {name!r} must increase strictly")
    keys, shapes = len(times), len(mesh.shapes)
    raw = reader.floats(sampler.output, "SCALAR")[:, 0]
    cubic = sampler.interpolation == "CUBICSPLINE"
    expected = keys * shapes * (3 if cubic else 1)
    if len(raw) != expected:
        raise InputError(
            f"{name!r} has {len(raw)} weights for mesh {mesh.name!r}; expected {expected} "
            f"({keys} keys, {shapes} blend shapes)"
        )
    if cubic:
        return _resampled(times, raw.reshape(keys, 3, shapes), f"{name}: {mesh.name}")
    curve = _Curve(times, raw.reshape(keys, shapes))
    if sampler.interpolation in (None, "LINEAR"):
        return curve, []
    if sampler.interpolation == "STEP":
        return _paired(curve), []
    raise InputError(f"{name!r} has the unknown interpolation {sampler.interpolation!r}")


def _paired(curve: _Curve) -> _Curve:
    """Keep each value until just before the next, different one."""
    jumps = np.flatnonzero((np.diff(curve.values, axis=0) != 0).any(axis=1)) + 1
    before = np.nextafter(curve.times[jumps].astype(np.float32), np.float32(-np.inf))
    fits = before > curve.times[jumps - 1]
    jumps, before = jumps[fits], before[fits]
    return _Curve(
        np.insert(curve.times, jumps, before),
        np.insert(curve.values, jumps, curve.values[jumps - 1], axis=0),
    )


def _resampled(times: FloatArray, keys: FloatArray, where: str) -> tuple[_Curve, list[Finding]]:
    """Turn Hermite segments into lines; `keys` (K, 3, S): in-tangent, value, out-tangent.

    A chord over a step h misses a curve by at most h^2 / 8 times its second derivative,
    which is linear over a segment and so largest at one of its ends.
    """
    span = np.diff(times)[:, None]
    start, stop = keys[:-1, 1], keys[1:, 1]
    leave, arrive = keys[:-1, 2] * span, keys[1:, 0] * span
    bend = np.maximum(
        np.abs(6 * (stop - start) - 4 * leave - 2 * arrive),
        np.abs(6 * (start - stop) + 2 * leave + 4 * arrive),
    ).max(axis=1, initial=0.0)
    parts = np.ceil(np.sqrt(bend / (8 * _TOLERANCE))).clip(1, _MOST_PARTS).astype(np.int64)
    segment = np.repeat(np.arange(len(parts)), parts)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(parts) - parts, parts)
    s = (step / parts[segment])[:, None]
    values = (
        (2 * s**3 - 3 * s**2 + 1) * start[segment]
        + (s**3 - 2 * s**2 + s) * leave[segment]
        + (3 * s**2 - 2 * s**3) * stop[segment]
        + (s**3 - s**2) * arrive[segment]
    )
    moments = times[segment] + s[:, 0] * span[segment, 0]
    curve = _Curve(np.append(moments, times[-1]), np.concatenate([values, keys[-1:, 1]]))
    error = (bend / (8 * parts**2)).max(initial=0.0)
    message = f"{len(times)} cubic keys became {len(curve.times)} linear ones, within {error:.1e}"
    return curve, [finding("CURVE_RESAMPLED", where, message)]


def _shared(
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
            message = f"moves unlike the shape of that name on another mesh; now {name!r}"
            found.append(finding("NAME_CHANGED", shape.name, message))
        shapes.append(replace(shape, name=name))
    return replace(mesh, shapes=tuple(shapes)), found


def _equal(one: FloatArray, other: FloatArray) -> bool:
    return np.allclose(one, other, rtol=_SAME, atol=_SAME)


def _rate(times: FloatArray) -> float:
    """Return the frame rate [Hz] whose frames all times fall on, 0 where there is none."""
    if len(times) < 2:
        return 0.0
    steps = np.diff(times)
    frames = np.round(steps / np.median(steps))
    rate = float(np.round(frames.sum() / (times[-1] - times[0]), 3))
    off = np.abs((times - times[0]) * rate - np.cumsum([0, *frames]))
    return rate if 0 < rate <= 1000 and off.max() < 0.02 else 0.0
