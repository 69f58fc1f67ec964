"""A take that is too long for memory: estimated from a sample, solved in pieces, joined.

Estimates for all frames, the neutral, places, space map, noise and covariance of the weights, come
from segments spread over the take. Given these, each frame depends on nearby ones alone: a piece
with a sufficient overlap has the weights of the whole. Markers are cleaned in blocks that do not
depend on the pieces.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, IntArray
from usdface.cleanup.clean import Cleaned
from usdface.cleanup.repairs import Repair
from usdface.closure.lid_apertures import Eye, LidApertures
from usdface.closure.mistracked_lids import (
    MistrackedLid,
    lid_pairs,
    lid_reach,
    mistracked_lids,
    with_replaced_lids,
)
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding, finding
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solution import Solution
from usdface.retarget.solve_piece import overlap_frames, settled, solve_piece
from usdface.retarget.solve_take import estimate_take
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget_take.clean import clean
from usdface.retarget_take.solver_input import solver_input
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.piece_cuts import PieceCuts
from usdface.shot.shot import Shot
from usdface.shot.solve import TakeSolver, checked_lids, solve_with_replaced_lids
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["EstimatedTake", "ReadFrames", "SolvedPiece", "estimate_shot", "solve_cut"]

ReadFrames = Callable[[IntArray], Shot]
"""Returns a shot with some frames of its take, by indices in ascending order."""

# Findings of the sample that are about its frames; those of all frames are counted at the end.
_OF_FRAMES = ("MARKER_OCCLUDED", "HEAD_MARKERS_FEW")


@dataclass(frozen=True, eq=False, slots=True)
class EstimatedTake:
    """The estimates of a take, and how far its pieces overlap.

    Attributes
    ----------
    estimates : TakeEstimates
    overlap : int
        Frames that a piece needs beyond each of its ends.
    findings : tuple of Finding
    lids : mapping of "left", "right" to LidApertures, or None
        Of the character, by which lid markers are judged.
    judged : int
        Frames beyond the overlap by which lid markers are judged; 0 where they cannot be.
    tracked : TakeEstimates or None
        With the mistracked lids of the sample, as the first solve of a whole take has them: a
        piece is judged by these. None where the sample has none: then by `estimates`.
    """

    estimates: TakeEstimates
    overlap: int
    findings: tuple[Finding, ...]
    lids: Mapping[Eye, LidApertures] | None = None
    judged: int = 0
    tracked: TakeEstimates | None = None

    @property
    def reach(self) -> int:
        """Frames that a piece reads beyond each of its ends."""
        return self.overlap + self.judged


@dataclass(frozen=True, eq=False, slots=True)
class SolvedPiece:
    """Frames of a marker take, cleaned and solved.

    Attributes
    ----------
    take : MarkerTake
        Its markers cleaned.
    solution : Solution
    repairs : tuple of Repair
    mistracked : tuple of MistrackedLid
        Frames of both are counted from the start of the whole take.
    """

    take: MarkerTake
    solution: Solution
    repairs: tuple[Repair, ...]
    mistracked: tuple[MistrackedLid, ...]


def estimate_shot(parts: Sequence[tuple[int, int, Shot]], cuts: PieceCuts) -> EstimatedTake:
    """Return the estimates of a take from its sample.

    Parameters
    ----------
    parts : sequence of (int, int, Shot)
        First frame and end of each block in which the sample has frames, in ascending order, and
        the frames around it (`PieceCuts.around`).
    cuts : PieceCuts

    Raises
    ------
    InputError
        If the take is one of weights.
    SolveError
        If the markers do not determine an answer, or the shapes are not linear.
    """
    shot = parts[0][2]
    if _marker_take(shot.take).dimension == 2:
        raise InputError(
            "a take of image points is not solved in pieces, since its camera is found from all "
            "frames; process it as a whole",
            "TAKE_KIND_WRONG",
        )
    neutral = shot.setup.neutral
    wanted = cuts.sample(neutral)
    times, positions = [], []
    for first, end, part in parts:
        take, measured, _ = _cleaned(_marker_take(part.take), part.setup, cuts, first, end)
        own = wanted[(wanted >= first) & (wanted < end)] - first
        times.append(take.times[own])
        positions.append(np.where(measured[own][..., None], take.positions[own], np.nan))
    take = replace(
        _marker_take(shot.take),
        times=np.concatenate(times),
        positions=np.concatenate(positions),
        blink=None,  # eyes close in the joined take
    )
    if neutral is not None:
        first, last = np.searchsorted(wanted, neutral).tolist()
        neutral = (first, last)
    known = _estimated(take, shot.face, replace(shot.setup, neutral=neutral))
    if len(wanted) < cuts.frames:
        message = (
            "neutral, places, map, noise and covariance come from {sample_count} of {frame_count} "
            "frames; pieces of {piece_count} frames overlap by {overlap_count} on both sides"
        )
        size = cuts.pieces[1] - cuts.pieces[0]
        counts = len(wanted), cuts.frames, size, known.overlap
        sampled = finding("TAKE_SAMPLED", take.source, message, *counts)
        known = replace(known, findings=(*known.findings, sampled))
    return known


def _estimated(sample: MarkerTake, face: BoundFace, setup: RetargetSetup) -> EstimatedTake:
    """Return the estimates from a sample, without the lids that are mistracked in it."""
    given = replace(setup, pins=())
    sample, given, surface, findings = solver_input(sample, face, given, None, None)
    names = face.shape_names
    bound = BoundPoints.on_skin(surface.skin, names)

    def estimated(take: MarkerTake) -> tuple[TakeEstimates, list[Finding]]:
        estimates, found = estimate_take(take, bound, given, surface=surface)
        return settled(take, estimates, names, given), found

    estimates, found = estimated(sample)
    overlap = overlap_frames(sample, estimates, names, setup)
    by_eye, judged, tracked = checked_lids(face, setup), 0, None
    if by_eye is not None and len(by_eye) == 2:
        solution = solve_piece(sample, estimates, names, given)
        contacts = face.with_contacts()
        if lid_pairs(contacts, solution, by_eye):
            judged = lid_reach(sample.times)
        lids = mistracked_lids(sample, contacts, solution, by_eye, judged)
        if lids:
            tracked = estimates
            estimates, found = estimated(with_replaced_lids(sample, lids))
            overlap = max(overlap, overlap_frames(sample, estimates, names, setup))
    findings += [each for each in found if each.code not in _OF_FRAMES]
    return EstimatedTake(estimates, overlap, tuple(findings), by_eye, judged, tracked)


def solve_cut(
    read: ReadFrames, cuts: PieceCuts, first: int, end: int, known: EstimatedTake
) -> SolvedPiece:
    """Clean and solve frames of a take, from block to block, by its estimates.

    Parameters
    ----------
    read : ReadFrames
    cuts : PieceCuts
    first, end : int
        The frames; ends of blocks.
    known : EstimatedTake
    """
    low, high = cuts.reached(first, end, known.reach)
    blocks = list(cuts.blocks_over(low, high))
    begin, stop = blocks[0][0], blocks[-1][1]
    start, read_end = cuts.around(begin, stop)
    shot = read(np.arange(start, read_end))
    whole = _marker_take(shot.take)
    cleaned = [
        _cleaned(whole.with_frames(slice(a0 - start, b0 - start)), shot.setup, cuts, a, b)
        for a, b in blocks
        for a0, b0 in [cuts.around(a, b)]
    ]
    take = replace(
        whole.with_frames(slice(begin - start, stop - start)),
        positions=np.concatenate([part.positions for part, _, _ in cleaned]),
    )
    measured = np.concatenate([seen for _, seen, _ in cleaned])
    reach, core = slice(low - begin, high - begin), slice(first - low, end - low)
    near = Cleaned(take.with_frames(reach), measured[reach], ())
    solution, lids = _solved(near, shot, slice(low - start, high - start), known)
    solution = _cut(solution, core)
    repairs = tuple(
        repair
        for (a, b), (_, _, found) in zip(blocks, cleaned, strict=True)
        if first <= a and b <= end
        for repair in found
    )
    take = with_replaced_lids(near.take, lids).with_frames(core)
    mistracked = tuple(lid.within(core, first) for lid in lids)
    return SolvedPiece(take, solution, repairs, mistracked)


def _solved(
    near: Cleaned, shot: Shot, reach: slice, known: EstimatedTake
) -> tuple[Solution, tuple[MistrackedLid, ...]]:
    """Return the solution of cleaned frames, `reach` of the shot's, and its mistracked lids."""
    setup = replace(shot.setup, neutral=None if shot.setup.neutral is None else (0, 0))
    pins = tuple(
        replace(pin, frames=pin.frames[inside] - reach.start, weights=pin.weights[inside])
        for pin in setup.pins
        for inside in [(pin.frames >= reach.start) & (pin.frames < reach.stop)]
        if inside.any()
    )
    face = shot.face
    take, setup, _, _ = solver_input(near.take, face, replace(setup, pins=pins), near, None)

    def solve_by(estimates: TakeEstimates) -> TakeSolver:
        return lambda take: (solve_piece(take, estimates, face.shape_names, setup), [])

    tracked = solve_by(known.tracked or known.estimates)
    corrected = solve_by(known.estimates) if known.tracked is not None else None
    (solution, _), lids = solve_with_replaced_lids(
        take, face, known.lids, known.judged, tracked, corrected
    )
    return solution, lids


def _cleaned(
    take: MarkerTake, setup: RetargetSetup, cuts: PieceCuts, start: int, stop: int
) -> tuple[MarkerTake, BoolArray, tuple[Repair, ...]]:
    """Return a block with cleaned markers, where they were measured, and the repairs.

    Parameters
    ----------
    take : MarkerTake
        The frames around the block.
    setup : RetargetSetup
        Its neutral frames are counted from the start of the whole take, as the repairs are.
    cuts : PieceCuts
    start, stop : int
        The block's first frame and end.
    """
    low, high = cuts.around(start, stop)
    if setup.neutral is not None:  # the labels of neutral frames are right, where it has any
        first, last = max(low, setup.neutral[0]), min(high - 1, setup.neutral[1])
        setup = replace(setup, neutral=(first - low, last - low) if first <= last else None)
    cleaned, _ = clean(take, setup)
    own = slice(start - low, stop - low)
    repairs = tuple(
        replace(repair, first=max(start, repair.first + low), last=min(stop - 1, repair.last + low))
        for repair in cleaned.repairs
        if repair.first + low < stop and repair.last + low >= start
    )
    return cleaned.take.with_frames(own), cleaned.measured[own], repairs


def _cut(solution: Solution, inside: slice) -> Solution:
    weights = solution.weights
    return replace(
        solution,
        weights=replace(weights, times=weights.times[inside], weights=weights.weights[inside]),
        pose=solution.pose.at(inside),
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
