"""A take that is too long for memory: estimated from a sample, solved in pieces, joined.

Estimates for all frames, the neutral, places, space map, noise and covariance of the weights, come
from segments spread over the take. Given these, each frame depends on nearby ones alone: a piece
with a sufficient overlap has the weights of the whole. Markers are cleaned in blocks that do not
depend on the pieces.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.clean import Cleaned
from usdface.cleanup.repairs import Repair, repair_findings
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose
from usdface.retarget.first_pose import head_markers_few
from usdface.retarget.solution import Solution
from usdface.retarget.solve_piece import overlap_frames, settled, solve_piece
from usdface.retarget.solve_take import estimate_take
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget.usable_markers import occlusions, unsolved_frames
from usdface.retarget_setup import RetargetSetup
from usdface.retarget_take import clean, solver_input
from usdface.shot import Shot, SolvedShot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["EstimatedTake", "PieceCuts", "ReadFrames", "estimate_shot", "join", "solve_cut"]

# Frames that are cleaned together, two minutes at 30 Hz, and blocks of a piece: 1 GB while it is
# solved, with 68 markers and 53 blend shapes.
_BLOCK = 4096
_BLOCKS = 4
# Segments of the sample, and frames of each.
_STRETCHES = 16
_STRETCH = 1024


class RowArrays(Protocol):
    """Arrays that grow by rows, as `usdface.io.mapped_arrays.MappedArrays`."""

    def append(self, name: str, rows: FloatArray) -> None:
        """Add rows to an array."""

    def mapped(self, name: str) -> FloatArray:
        """Return an array of all its rows, read-only."""


ReadFrames = Callable[[IntArray], Shot]
"""Returns a shot with some frames of its take, by indices in ascending order."""

# Findings of the sample that are about its frames; those of all frames are counted at the end.
_OF_FRAMES = ("MARKER_OCCLUDED", "HEAD_MARKERS_FEW", "FRAME_UNSOLVED", "PIN_IGNORED")


@dataclass(frozen=True, slots=True)
class PieceCuts:
    """The places where a take is cut.

    Attributes
    ----------
    frames : int
        Of the take.
    blocks : tuple of int
        First frames of the blocks of the clean-up, and the end.
    pieces : tuple of int
        The same of the pieces, whose ends are ends of blocks.
    """

    frames: int
    blocks: tuple[int, ...]
    pieces: tuple[int, ...]

    @classmethod
    def of(cls, frames: int) -> "PieceCuts":
        """Return the cuts of a take; its last block has half a block at least."""
        blocks = list(range(0, max(1, frames - _BLOCK // 2), _BLOCK))
        return cls(frames, (*blocks, frames), (*blocks[::_BLOCKS], frames))

    def piece(self, number: int) -> tuple[int, int]:
        """Return first frame and end of a piece."""
        return self.pieces[number], self.pieces[number + 1]

    def __len__(self) -> int:
        """Return the number of pieces."""
        return len(self.pieces) - 1

    def blocks_over(self, first: int, end: int) -> Iterator[tuple[int, int]]:
        """Yield first frame and end of the blocks that frames from `first` to `end` lie in."""
        for start, stop in pairwise(self.blocks):
            if start < end and stop > first:
                yield start, stop

    def sample(self, neutral: tuple[int, int] | None) -> IntArray:
        """Return the frames that estimates come from: stretches, and the neutral frames."""
        wanted = np.zeros(self.frames, dtype=bool)
        if self.frames <= _STRETCHES * _STRETCH:
            wanted[:] = True
        for start in np.linspace(0, max(0, self.frames - _STRETCH), _STRETCHES).astype(int):
            wanted[start : start + _STRETCH] = True
        if neutral is not None:
            wanted[neutral[0] : neutral[1] + 1] = True
        return np.flatnonzero(wanted)


@dataclass(frozen=True, eq=False, slots=True)
class EstimatedTake:
    """The estimates of a take, and how far its pieces overlap.

    Attributes
    ----------
    estimates : TakeEstimates
    overlap : int
        Frames that a piece needs beyond each of its ends.
    findings : tuple of Finding
    """

    estimates: TakeEstimates
    overlap: int
    findings: tuple[Finding, ...]


def estimate_shot(parts: Sequence[tuple[int, Shot]], cuts: PieceCuts) -> EstimatedTake:
    """Return the estimates of a take from its sample.

    Parameters
    ----------
    parts : sequence of (int, Shot)
        First frame and frames of each block in which the sample has frames, in ascending order.
    cuts : PieceCuts

    Raises
    ------
    InputError
        If the take is one of weights.
    SolveError
        If the markers do not determine an answer, or the shapes are not linear.
    """
    shot = parts[0][1]
    if _marker_take(shot.take).dimension == 2:
        raise InputError(
            "a take of image points is not solved in pieces, since its camera is found from all "
            "frames; process it as a whole",
            "TAKE_KIND_WRONG",
        )
    neutral = shot.setup.neutral
    wanted = cuts.sample(neutral)
    times, positions = [], []
    for first, part in parts:
        take, measured, _ = _cleaned(_marker_take(part.take), part.setup)
        own = wanted[(wanted >= first) & (wanted < first + len(take.times))] - first
        times.append(take.times[own])
        positions.append(np.where(measured[own][..., None], take.positions[own], np.nan))
    take = replace(
        _marker_take(shot.take), times=np.concatenate(times), positions=np.concatenate(positions)
    )
    if neutral is not None:
        first, last = np.searchsorted(wanted, neutral).tolist()
        neutral = (first, last)
    face, given = shot.face, replace(shot.setup, neutral=neutral, pins=())
    take, setup, surface, findings = solver_input(take, face, given, None, None)
    skin = surface.skin
    estimates, found = estimate_take(
        take,
        skin.rest,
        skin.offsets,
        face.shape_names,
        setup,
        skin.marker_evaluator,
        surface=surface,
    )
    estimates = settled(take, estimates, face.shape_names, setup)
    overlap = overlap_frames(take, estimates, face.shape_names, shot.setup)
    findings += [each for each in found if each.code not in _OF_FRAMES]
    if len(wanted) < cuts.frames:
        message = (
            "neutral, places, map, noise and covariance come from {sample_count} of {frame_count} "
            "frames; pieces of {piece_count} frames overlap by {overlap_count} on both sides"
        )
        size = cuts.pieces[1] - cuts.pieces[0]
        source = take.source
        findings.append(
            finding("TAKE_SAMPLED", source, message, len(wanted), cuts.frames, size, overlap)
        )
    return EstimatedTake(estimates, overlap, tuple(findings))


def solve_cut(
    read: ReadFrames, cuts: PieceCuts, first: int, end: int, known: EstimatedTake
) -> SolvedShot:
    """Clean and solve frames of a take, from block to block, by its estimates.

    Parameters
    ----------
    read : ReadFrames
    cuts : PieceCuts
    first, end : int
        The frames; ends of blocks.
    known : EstimatedTake
    """
    low, high = max(0, first - known.overlap), min(cuts.frames, end + known.overlap)
    blocks = list(cuts.blocks_over(low, high))
    begin = blocks[0][0]
    shot = read(np.arange(begin, blocks[-1][1]))
    whole = _marker_take(shot.take)
    cleaned = [_cleaned(_part(whole, a - begin, b - begin), shot.setup) for a, b in blocks]
    take = replace(whole, positions=np.concatenate([part.positions for part, _, _ in cleaned]))
    measured = np.concatenate([seen for _, seen, _ in cleaned])
    reach = slice(low - begin, high - begin)
    setup = replace(shot.setup, neutral=None if shot.setup.neutral is None else (0, 0))
    pins = tuple(
        replace(pin, frames=pin.frames[inside] - reach.start, weights=pin.weights[inside])
        for pin in setup.pins
        for inside in [(pin.frames >= reach.start) & (pin.frames < reach.stop)]
        if inside.any()
    )
    near = Cleaned(_part(take, reach.start, reach.stop), measured[reach], ())
    face = shot.face
    seen, setup, _, _ = solver_input(near.take, face, replace(setup, pins=pins), near, None)
    solution = solve_piece(seen, known.estimates, face.shape_names, setup)
    core = slice(first - low, end - low)
    repairs = tuple(
        replace(repair, first=repair.first + start, last=repair.last + start)
        for (start, stop), (_, _, found) in zip(blocks, cleaned, strict=True)
        if first <= start and stop <= end
        for repair in found
    )
    solution = _cut(solution, core)
    return SolvedShot(_part(take, first - begin, end - begin), solution.weights, solution, repairs)


def join(pieces: Iterable[SolvedShot], known: EstimatedTake, arrays: RowArrays) -> SolvedShot:
    """Join the pieces of a take.

    Parameters
    ----------
    pieces : iterable of SolvedShot
        All of them, in order; each is freed before the next is taken.
    known : EstimatedTake
    arrays : RowArrays
        The rows of the result.
    """
    last = None
    repairs: list[Repair] = []
    for piece in pieces:
        take, solution = _marker_take(piece.take), piece.solution
        assert solution is not None
        for name, part in (
            ("times", take.times),
            ("positions", take.positions),
            ("weights", solution.weights.weights),
            ("rotations", solution.pose.rotations),
            ("translations", solution.pose.translations),
            ("residual", solution.residual),
            ("feature_points", solution.feature_points),
            ("distances", solution.distances),
        ):
            arrays.append(name, part)
        repairs += piece.repairs
        last = take, solution
    assert last is not None
    take, solution = last
    take = replace(take, times=arrays.mapped("times"), positions=arrays.mapped("positions"))
    weights = replace(solution.weights, times=take.times, weights=arrays.mapped("weights"))
    pose = Pose(arrays.mapped("rotations"), arrays.mapped("translations"))
    distances = arrays.mapped("distances")
    whole = replace(
        solution,
        weights=weights,
        pose=pose.bridged(_posed(distances)),
        residual=arrays.mapped("residual"),
        feature_points=arrays.mapped("feature_points"),
        distances=distances,
    )
    mended = _mended(repairs)
    findings = (*repair_findings(mended), *known.findings, *_of_all_frames(whole, take))
    return SolvedShot(take, weights, whole, mended, findings)


def _of_all_frames(solution: Solution, take: MarkerTake) -> list[Finding]:
    """Return the findings that count frames."""
    seen = ~np.isnan(solution.distances)
    found = occlusions(solution.markers, (~seen).sum(axis=0), len(seen))
    found += head_markers_few(_posed(solution.distances), take.source)
    return found + unsolved_frames(seen, take.source)


def _posed(distances: FloatArray) -> BoolArray:
    """Return the frames (F,) with a pose: others have distances (F, B) of no marker."""
    return np.asarray((~np.isnan(distances)).sum(axis=1) >= POSE_MARKERS)


def _mended(repairs: Sequence[Repair]) -> tuple[Repair, ...]:
    """Return repairs by kind, marker and frame; those that a cut split are merged."""
    kinds = ("swap", "spike", "fill")
    done: list[Repair] = []
    for repair in sorted(repairs, key=lambda r: (kinds.index(r.kind), r.marker, r.first)):
        last = done[-1] if done else None
        if last and (last.kind, last.marker, last.last + 1) == (
            repair.kind,
            repair.marker,
            repair.first,
        ):
            done[-1] = replace(last, last=repair.last)
        else:
            done.append(repair)
    return tuple(done)


def _cleaned(
    take: MarkerTake, setup: RetargetSetup
) -> tuple[MarkerTake, BoolArray, tuple[Repair, ...]]:
    """Return a block with cleaned markers, where they were measured, and the repairs."""
    _, cleaned, _ = clean(take, setup)
    assert cleaned is not None
    return cleaned.take, cleaned.measured, cleaned.repairs


def _part(take: MarkerTake, first: int, end: int) -> MarkerTake:
    return replace(take, times=take.times[first:end], positions=take.positions[first:end])


def _cut(solution: Solution, inside: slice) -> Solution:
    weights = solution.weights
    return replace(
        solution,
        weights=replace(weights, times=weights.times[inside], weights=weights.weights[inside]),
        pose=Pose(solution.pose.rotations[inside], solution.pose.translations[inside]),
        residual=solution.residual[inside],
        feature_points=solution.feature_points[inside],
        distances=solution.distances[inside],
    )


def _marker_take(take: MarkerTake | WeightsTake) -> MarkerTake:
    if isinstance(take, MarkerTake):
        return take
    raise InputError(
        "a take of weights is not solved, so not in pieces; process it as a whole",
        "TAKE_KIND_WRONG",
    )
