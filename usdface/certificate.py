"""Certificates: by how much what was written differs from what was read.

Two evaluations of the same character are compared: one of the source, one of the file that
was written, each by code of its own. Vertices are split and joined on the way, so they are
not compared by number: a vertex is paired with the one of the other side that moves as it
does.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.findings import Finding, finding
from usdface.partners import Traits, partners
from usdface.sums import Sums, distances, turns
from usdface.takes import FloatArray, IntArray

__all__ = ["Certificate", "EvaluatedMesh", "certify", "joined", "paired", "some_frames"]

_EXACT = 1e-5  # of the bounding diagonal, a weight, a second: what float32 costs
_FLOAT32 = 2.0**-23  # of a number: what float32 can tell apart
_STRAIGHT = 0.5  # degrees
_SHOWN = 20  # frames in which the programs themselves show what else is summed up
_ADDS_UP = 1e-6  # of the largest coordinate
_TURNS_ALIKE = 1e-4  # of a unit normal, which may come of three that nearly cancel
_BLOCK = 2**19  # numbers of one evaluation at once


@dataclass(frozen=True, eq=False, slots=True)
class EvaluatedMesh:
    """One mesh as a program shows it at F moments.

    Attributes
    ----------
    name : str
    shapes : tuple of str, length S
    weights : (F, S) float64
    points_at : function from frames (f,) to (f, N, 3) float64 [m]
    normals_at : function from frames (f,) to (f, N, 3) unit vectors, or None
    sums : function to Sums or None
        All F moments as sums of what the program itself makes of each shape; None where more than
        shapes move points.
    """

    name: str
    shapes: tuple[str, ...]
    weights: FloatArray
    points_at: Callable[[IntArray], FloatArray]
    normals_at: Callable[[IntArray], FloatArray | None]
    sums: Callable[[], Sums | None] = lambda: None


@dataclass(frozen=True, slots=True)
class Certificate:
    """How well a conversion kept what it was given.

    Attributes
    ----------
    frames, of_frames : int
        Frames that were compared, and that there are.
    diagonal : float [m]
        Of the source's bounding box at rest.
    vertex_largest, vertex_mean : float [m]
    vertex_worst : str
        Mesh of the largest vertex error.
    normal_largest, normal_mean : float [degrees] or None
        None where the source has no deformed vertex normals to compare with.
    weights : dict of str to float
        Largest error of each channel, ``mesh/shape``.
    weight_excess : float
        Largest of these errors beyond what comes of times that are numbers of 32 bits.
    time_drift : float [s]
    duration : float [s]
        The last moment.
    names : dict of str to str
        Names of meshes and channels in the source, and in the result if they differ.
    missing : tuple of str
        Meshes, channels and clips that only one side has.
    decoded : bool
        Compressed data were decoded for the evaluation by the decoder of the conversion.
    clips : mapping of str to Certificate
        Each clip for itself, where there are several.
    """

    frames: int
    of_frames: int
    diagonal: float
    vertex_largest: float
    vertex_mean: float
    vertex_worst: str
    normal_largest: float | None
    normal_mean: float | None
    weights: dict[str, float]
    weight_excess: float
    time_drift: float
    duration: float
    names: dict[str, str]
    missing: tuple[str, ...]
    clips: Mapping[str, "Certificate"] = field(default_factory=dict)
    decoded: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate as plain values, each name with its unit."""
        clips = {name: clip.as_dict() for name, clip in self.clips.items()}
        return {
            "frames compared": self.frames,
            "frames": self.of_frames,
            "bounding diagonal mm": 1000 * self.diagonal,
            "vertex error mm, largest": 1000 * self.vertex_largest,
            "vertex error mm, mean": 1000 * self.vertex_mean,
            "vertex error, mesh of the largest": self.vertex_worst,
            "normal error degrees, largest": self.normal_largest,
            "normal error degrees, mean": self.normal_mean,
            "weight error, largest": max(self.weights.values(), default=0.0),
            "weight error of each channel": self.weights,
            "time drift s": self.time_drift,
            "names": self.names,
            "missing": list(self.missing),
            "decoded by the conversion's own decoder": self.decoded,
        } | ({"clips": clips} if clips else {})

    def line(self) -> str:
        """Return the certificate in one line."""
        turned = "" if self.normal_largest is None else f", normals {self.normal_largest:.2g} deg"
        return (
            f"vertices {1000 * self.vertex_largest:.2g} mm{turned}, "
            f"weights {max(self.weights.values(), default=0.0):.2g}, "
            f"times {self.time_drift:.2g} s at most, in {self.frames} of {self.of_frames} frames"
        )

    def findings(self, where: str) -> list[Finding]:
        """Return a warning for each thing that is off by more than numbers of 32 bits cost."""
        limit = _EXACT * self.diagonal
        weight = max(self.weights.values(), default=0.0)
        turned = self.normal_largest or 0.0
        losses = [
            (self.vertex_largest > limit, f"vertices by {1000 * self.vertex_largest:.3g} mm"),
            (turned > _STRAIGHT, f"normals by {turned:.3g} degrees"),
            (self.weight_excess > _EXACT, f"weights by {weight:.3g}"),
            (
                self.time_drift > max(_EXACT, _FLOAT32 * self.duration),
                f"times by {self.time_drift:.3g} s",
            ),
            (bool(self.missing), f"only on one side: {', '.join(self.missing)}"),
        ]
        said = "; ".join(text for lost, text in losses if lost)
        return [finding("CONVERSION_INEXACT", where, f"is off: {said}")] if said else []


def some_frames(count: int, vertices: int, budget: int) -> IntArray:
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
        name, or by place where there are equally many.
    frames : (n,) int64
        Frames whose points and normals are compared; weights are in all frames.
    time_drift : float [s]
        By how much keys moved.
    times : (F,) float64 [s]
        The moments, which increase.
    """
    pairs, missing = paired([m.name for m in source], [m.name for m in result], "")
    names: dict[str, str] = {}
    weights: dict[str, float] = {}
    excess = 0.0
    vertex, normal = _Errors(), _Errors()
    worst, diagonal = "", 0.0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for one, other in ((source[i], result[j]) for i, j in pairs):
        if one.name != other.name:
            names[one.name] = other.name
        columns, lost = paired(one.shapes, other.shapes, f"{one.name}/")
        missing += lost
        for i, j in columns:
            channel = f"{one.name}/{one.shapes[i]}"
            if one.shapes[i] != other.shapes[j]:
                names[channel] = f"{other.name}/{other.shapes[j]}"
            off = np.abs(one.weights[:, i] - other.weights[:, j])
            weights[channel] = max(weights.get(channel, 0.0), float(off.max(initial=0.0)))
            excess = max(excess, float((off - _slack(one.weights[:, i], times)).max(initial=0.0)))
        rest = one.points_at(frames[:1])[0]
        low, high = np.minimum(low, rest.min(axis=0)), np.maximum(high, rest.max(axis=0))
        before = vertex.largest
        _compare(one, other, frames, vertex, normal)
        worst = one.name if vertex.largest > before or not worst else worst
    if pairs:
        diagonal = float(np.linalg.norm(high - low))
    return Certificate(
        len(frames),
        len(source[0].weights) if source else 0,
        diagonal,
        vertex.largest,
        vertex.mean,
        worst,
        normal.largest if normal.count else None,
        normal.mean if normal.count else None,
        weights,
        excess,
        time_drift,
        0.0 if times is None else float(times[-1]),
        names,
        tuple(missing),
    )


def _slack(weights: FloatArray, times: FloatArray | None) -> FloatArray:
    """Return by how much weights (F,) change while times are off by their rounding."""
    if times is None or len(times) < 2:
        return np.zeros(len(weights))
    speed = np.abs(np.diff(weights)) / np.diff(times)
    around = np.maximum(np.append(speed, 0.0), np.append(0.0, speed))
    return np.asarray(around * _FLOAT32 * times[-1])


def paired(
    one: Sequence[str], other: Sequence[str], prefix: str
) -> tuple[list[tuple[int, int]], list[str]]:
    """Return which of `one` and `other` belong together, and what only one side has.

    By name, or by place where there are equally many.
    """
    named = len(set(one)) == len(one) and set(one) == set(other)
    if len(one) == len(other) and not named:
        return list(zip(range(len(one)), range(len(one)), strict=True)), []
    place = {name: k for k, name in reversed(list(enumerate(other)))}
    pairs = [(k, place[name]) for k, name in enumerate(one) if name in place]
    lonely = [n for n in one if n not in place] + [n for n in other if n not in set(one)]
    return pairs, [prefix + name for name in lonely]


def joined(clips: Mapping[str, Certificate], missing: Sequence[str]) -> Certificate:
    """Return one certificate for all clips of a character; `missing` are what one side lacks."""
    parts = list(clips.values())
    if not parts:
        return replace(certify([], [], np.zeros(0, np.int64)), missing=tuple(missing))
    worst = max(parts, key=lambda part: part.vertex_largest)
    turned = [p for p in parts if p.normal_largest is not None]
    weights: dict[str, float] = {}
    for part in parts:
        for channel, off in part.weights.items():
            weights[channel] = max(weights.get(channel, 0.0), off)
    lacking = dict.fromkeys([*missing, *(name for part in parts for name in part.missing)])
    return Certificate(
        sum(p.frames for p in parts),
        sum(p.of_frames for p in parts),
        max(p.diagonal for p in parts),
        worst.vertex_largest,
        _mean(parts, [p.vertex_mean for p in parts]),
        worst.vertex_worst,
        max((p.normal_largest or 0.0 for p in turned), default=None),
        _mean(turned, [p.normal_mean or 0.0 for p in turned]) if turned else None,
        weights,
        max(p.weight_excess for p in parts),
        max(p.time_drift for p in parts),
        max(p.duration for p in parts),
        {name: now for part in parts for name, now in part.names.items()},
        tuple(lacking),
        clips if len(clips) > 1 else {},
    )


def _mean(parts: Sequence[Certificate], values: Sequence[float]) -> float:
    frames = [max(part.frames, 1) for part in parts]
    return float(np.average(values, weights=frames))


class _Errors:
    """Largest and mean of numbers that come in blocks."""

    def __init__(self) -> None:
        self.largest, self.total, self.count = 0.0, 0.0, 0

    def add(self, values: NDArray[Any]) -> None:
        self.largest = max(self.largest, float(values.max(initial=0.0)))
        self.total += float(values.sum())
        self.count += values.size

    @property
    def mean(self) -> float:
        return self.total / max(self.count, 1)


def _compare(
    one: EvaluatedMesh, other: EvaluatedMesh, frames: IntArray, vertex: _Errors, normal: _Errors
) -> None:
    here, there = pairs = _partners(one, other, frames)
    shown = frames[some_frames(len(frames), 1, _SHOWN)]
    sums = _sums(one, other, shown) if len(shown) < len(frames) else None
    if sums is not None:
        summed = np.setdiff1d(frames, shown)
        for apart in distances(*sums, pairs, summed):
            vertex.add(apart)
        for turned in turns(*sums, pairs, summed):
            normal.add(_degrees(turned))
        frames = shown
    for part in _blocks(len(frames), 3 * len(here)):
        block = frames[part]
        vertex.add(_apart(one.points_at(block)[:, here], other.points_at(block)[:, there]))
        mine, its = one.normals_at(block), other.normals_at(block)
        if mine is not None and its is not None:
            # The chord gives small angles, where the cosine has no digits left.
            chord = _apart(mine[:, here], its[:, there])
            normal.add(_degrees(chord))


def _degrees(chord: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.degrees(2 * np.arcsin((chord / 2).clip(max=1.0))))


def _sums(one: EvaluatedMesh, other: EvaluatedMesh, frames: IntArray) -> tuple[Sums, Sums] | None:
    """Return both meshes as sums, if what their programs show at `frames` is these sums."""
    both = one.sums(), other.sums()
    for mesh, sums in zip((one, other), both, strict=True):
        if sums is None or (sums.normals is None) != (mesh.normals_at(frames[:1]) is None):
            return None
        size = float(np.abs(sums.points).max(initial=0.0))
        for frame in frames:
            off = np.abs(sums.points_at(frame) - mesh.points_at(frame[None])[0])
            turned, seen = sums.normals_at(frame), mesh.normals_at(frame[None])
            aside = 0.0 if turned is None or seen is None else np.abs(turned - seen[0]).max()
            if off.max(initial=0.0) > _ADDS_UP * size or aside > _TURNS_ALIKE:
                return None
    assert both[0] is not None and both[1] is not None
    return both[0], both[1]


def _apart(one: FloatArray, other: FloatArray) -> FloatArray:
    difference = one - other
    return np.asarray(np.sqrt(np.einsum("fvk,fvk->fv", difference, difference)), np.float64)


def _partners(
    one: EvaluatedMesh, other: EvaluatedMesh, frames: IntArray
) -> tuple[IntArray, IntArray]:
    """Return pairs of vertices that move alike.

    They are told apart at the first of `frames` and in mixtures of those in which some channel
    is strongest.
    """
    strongest = np.abs(one.weights[frames]).argmax(axis=0) if one.weights.size else []
    chosen = frames[np.unique(np.concatenate([[0], strongest]).astype(np.int64))]
    mix = np.random.default_rng(0).normal(size=(3, len(chosen))) / np.sqrt(len(chosen))

    def traits(mesh: EvaluatedMesh) -> Traits:
        rest = mesh.points_at(chosen[:1])[0]
        mixed = np.zeros((3, *rest.shape))
        for block in _blocks(len(chosen), rest.size):
            mixed += np.tensordot(mix[:, block], mesh.points_at(chosen[block]), 1)
        normals = mesh.normals_at(chosen[:1])
        places = np.concatenate([rest, *mixed], 1)
        return Traits(places, None if normals is None else normals[0])

    return partners(traits(one), traits(other))


def _blocks(frames: int, numbers: int) -> list[slice]:
    """Return slices of `frames` of which each has so many numbers, as many as memory allows."""
    step = max(1, _BLOCK // max(numbers, 1))
    return [slice(start, start + step) for start in range(0, frames, step)]
