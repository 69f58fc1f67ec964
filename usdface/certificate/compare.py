"""Two evaluations of one character compared, frame by frame."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.certificate import FLOAT32, Certificate
from usdface.certificate.error_totals import ErrorTotals, largest
from usdface.certificate.evaluated_mesh import EvaluatedMesh
from usdface.certificate.linear_morph import (
    LinearMorph,
    normal_distances,
    point_distances,
)
from usdface.certificate.stored_steps import StoredSteps, turned_by
from usdface.certificate.vertex_pairs import blocks, vertex_pairs

__all__ = ["certify", "match_names", "sample_frames"]

_VERIFIED_FRAMES = (
    20  # frames in which linear morphs are checked against the programs' own evaluation
)
_SUMMED_FRAMES = 100  # fewer are evaluated sooner than sums are made
_POINT_TOLERANCE = 1e-6  # of the largest coordinate: 8 roundings of float32
_FEW_SHAPES = 64  # whose sum is within it; errors grow as the root of their number (781: 1.1e-6)
_NORMAL_TOLERANCE = 1e-4  # of a unit normal, which may come of three that nearly cancel


def sample_frames(count: int, vertices: int, budget: int) -> IntArray:
    """Return evenly spread frames (n,) of `count`, so that n * vertices stays below `budget`."""
    most = max(2, budget // max(vertices, 1))
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def certify(
    source: Sequence[EvaluatedMesh],
    result: Sequence[EvaluatedMesh],
    frames: IntArray,
    time_drift: float = 0.0,
    times: FloatArray | None = None,
) -> Certificate:
    """Compare two evaluations of one character.

    Parameters
    ----------
    source, result : sequence of EvaluatedMesh
        Evaluated at the same F moments. Meshes, and the shapes of a mesh, belong together by
        name, or by place where there are equally many. What a result that is stored as whole
        numbers is off by their rounding is in the errors, but not in the excess; nor is what a
        source is off from `EvaluatedMesh.requested`.
    frames : (n,) int64
        Frames whose points and normals are compared; weights are in all frames.
    time_drift : float [s]
        By how much keys moved.
    times : (F,) float64 [s]
        The moments, which increase.
    """
    pairs, missing = match_names([m.name for m in source], [m.name for m in result], "")
    names: dict[str, str] = {}
    weights: dict[str, float] = {}
    excess = 0.0
    vertex, normal = ErrorTotals(), ErrorTotals()
    worst, diagonal = "", 0.0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for one, other in ((source[i], result[j]) for i, j in pairs):
        if one.name != other.name:
            names[one.name] = other.name
        columns, lost = match_names(one.shapes, other.shapes, f"{one.name}/")
        missing += lost
        for i, j in columns:
            channel = f"{one.name}/{one.shapes[i]}"
            if one.shapes[i] != other.shapes[j]:
                names[channel] = f"{other.name}/{other.shapes[j]}"
            off = np.abs(one.weights[:, i] - other.weights[:, j])
            weights[channel] = max(weights.get(channel, 0.0), largest(off))
            excess = max(excess, largest(off - _rounding_error(one.weights[:, i], times)))
        rest = one.points_at(frames[:1])[0]
        low, high = np.minimum(low, rest.min(axis=0)), np.maximum(high, rest.max(axis=0))
        before = vertex.largest
        _compare(one, other, frames, vertex, normal)
        worst = one.name if vertex.largest > before or not worst else worst
    if pairs:
        diagonal = float(np.linalg.norm(high - low))
    return Certificate(
        frames=len(frames),
        of_frames=len(source[0].weights) if source else 0,
        diagonal=diagonal,
        vertex_largest=vertex.largest,
        vertex_mean=vertex.mean,
        vertex_worst=worst,
        normal_largest=normal.largest if normal.count else None,
        normal_mean=normal.mean if normal.count else None,
        weights=weights,
        weight_excess=excess,
        vertex_excess=vertex.excess,
        normal_excess=normal.excess,
        vertex_rounding=vertex.rounding,
        normal_rounding=normal.rounding,
        time_drift=time_drift,
        duration=0.0 if times is None else float(times[-1]),
        names=names,
        missing=tuple(missing),
    )


def _rounding_error(weights: FloatArray, times: FloatArray | None) -> FloatArray:
    """Return the change of weights (F,) within the rounding of times to float32."""
    if times is None or len(times) < 2:
        return np.zeros(len(weights))
    speed = np.abs(np.diff(weights)) / np.diff(times)
    around = np.maximum(np.append(speed, 0.0), np.append(0.0, speed))
    return np.asarray(around * FLOAT32 * times[-1])


def match_names(
    one: Sequence[str], other: Sequence[str], prefix: str
) -> tuple[list[tuple[int, int]], list[str]]:
    """Return pairs of indices into `one` and `other`, and the names that only one side has.

    By name, or by place where there are equally many.
    """
    named = len(set(one)) == len(one) and set(one) == set(other)
    if len(one) == len(other) and not named:
        return list(zip(range(len(one)), range(len(one)), strict=True)), []
    place = {name: k for k, name in reversed(list(enumerate(other)))}
    pairs = [(k, place[name]) for k, name in enumerate(one) if name in place]
    unmatched = [n for n in one if n not in place] + [n for n in other if n not in set(one)]
    return pairs, [prefix + name for name in unmatched]


def _compare(
    one: EvaluatedMesh,
    other: EvaluatedMesh,
    frames: IntArray,
    vertex: ErrorTotals,
    normal: ErrorTotals,
) -> None:
    requested = one.requested or one
    sums = _linear_morphs(requested, other, frames)
    pairs = vertex_pairs(requested, other, frames, sums)
    if one.requested is None:
        _add_errors(one, other, frames, sums, pairs, vertex, normal)
        return
    # The errors are those against the source, what is beyond the request those against its change.
    before = vertex.excess, normal.excess
    _add_errors(one, other, frames, _linear_morphs(one, other, frames), pairs, vertex, normal)
    beyond = ErrorTotals(), ErrorTotals()
    _add_errors(requested, other, frames, sums, pairs, *beyond)
    for total, excess, found in zip((vertex, normal), before, beyond, strict=True):
        total.set_excess(excess, found)


def _add_errors(
    one: EvaluatedMesh,
    other: EvaluatedMesh,
    frames: IntArray,
    sums: tuple[LinearMorph, LinearMorph] | None,
    pairs: tuple[IntArray, IntArray],
    vertex: ErrorTotals,
    normal: ErrorTotals,
) -> None:
    steps = other.steps
    here, there = pairs
    if sums is not None:
        shown = _verified(frames)
        summed = np.setdiff1d(np.arange(len(frames)), shown)
        rounding, aside = _rounding(steps, frames[summed])
        for away in point_distances(*sums, pairs, summed):
            times = len(summed) // max(len(away), 1)
            vertex.add(away, _of_rows(rounding, len(away)), times)
        for turned, lengths in normal_distances(*sums, pairs, summed):
            most = _of_rows(aside, len(turned))
            angles = None if most is None else turned_by(most, lengths)
            normal.add(_degrees(turned), angles, len(summed) // max(len(turned), 1))
        frames = frames[shown]
    for part in blocks(len(frames), 3 * len(here)):
        block = frames[part]
        apart = _distances(one.points_at(block)[:, here], other.points_at(block)[:, there])
        vertex.add(apart, None if steps is None else steps.of_points(block)[:, None])
        mine, its = one.normals_at(block), other.normals_at(block)
        if mine is not None and its is not None:
            # The chord gives small angles, where the cosine has no digits left.
            chord = _distances(mine[:, here], its[:, there])
            angles = None if steps is None else steps.of_angles(block)[:, there]
            normal.add(_degrees(chord), angles)


def _verified(frames: IntArray) -> IntArray:
    """Return the places of frames in which linear morphs are checked."""
    return sample_frames(len(frames), 1, _VERIFIED_FRAMES)


def _rounding(
    steps: StoredSteps | None, frames: IntArray
) -> tuple[FloatArray, FloatArray] | tuple[None, None]:
    """Return by how much points and normals, before they get unit length, may be off: (f, 1)."""
    if steps is None:
        return None, None
    return steps.of_points(frames)[:, None], steps.of_normals(frames)[:, None]


def _of_rows(rounding: FloatArray | None, rows: int) -> FloatArray | None:
    """Return the rounding (f, 1) of a block with f rows; the least, if it has one for all."""
    if rounding is None or rows == len(rounding):
        return rounding
    return np.asarray(rounding.min(axis=0, keepdims=True))


def _degrees(chord: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.degrees(2 * np.arcsin((chord / 2).clip(max=1.0))))


def _linear_morphs(
    one: EvaluatedMesh, other: EvaluatedMesh, frames: IntArray
) -> tuple[LinearMorph, LinearMorph] | None:
    """Return both meshes at many `frames` as linear morphs, if programs agree at some of them."""
    if len(frames) < _SUMMED_FRAMES:
        return None
    shown = _verified(frames)
    both = one.linear_morph(frames), other.linear_morph(frames)
    for mesh, sums in zip((one, other), both, strict=True):
        if sums is None or (sums.normals is None) != (mesh.normals_at(frames[:1]) is None):
            return None
        size = float(np.abs(sums.points).max(initial=0.0))
        for moment in shown:
            frame = frames[moment : moment + 1]
            off = np.abs(sums.points_at(moment) - mesh.points_at(frame)[0])
            turned, seen = sums.normals_at(moment), mesh.normals_at(frame)
            aside = 0.0 if turned is None or seen is None else np.abs(turned - seen[0]).max()
            count = np.count_nonzero(sums.weights[moment])
            tolerance = _POINT_TOLERANCE * size * max(1.0, np.sqrt(count / _FEW_SHAPES))
            if off.max(initial=0.0) > tolerance or aside > _NORMAL_TOLERANCE:
                return None
    assert both[0] is not None and both[1] is not None
    return both[0], both[1]


def _distances(one: FloatArray, other: FloatArray) -> FloatArray:
    difference = one - other
    return np.asarray(np.sqrt(np.einsum("fvk,fvk->fv", difference, difference)), np.float64)
