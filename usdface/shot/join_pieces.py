"""The pieces of a take joined: rows in files, repairs that a cut split, findings of all frames."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.repairs import Repair, repair_findings
from usdface.closure.mistracked_lids import MistrackedLid, joined_lids, mistracked_findings
from usdface.findings import Finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.first_pose import head_markers_few, shows_pose
from usdface.retarget.usable_markers import occlusions, unsolved_frames
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece
from usdface.shot.shot import SolvedShot

__all__ = ["RowArrays", "join"]


class RowArrays(Protocol):
    """Arrays that grow by rows, as `usdface.io.mapped_arrays.MappedArrays`."""

    def append(self, name: str, rows: FloatArray) -> None:
        """Add rows to an array."""

    def mapped(self, name: str) -> FloatArray:
        """Return an array of all its rows, read-only."""


def join(pieces: Iterable[SolvedPiece], known: EstimatedTake, arrays: RowArrays) -> SolvedShot:
    """Join the pieces of a take.

    Parameters
    ----------
    pieces : iterable of SolvedPiece
        All of them, in order; each is freed before the next is taken.
    known : EstimatedTake
    arrays : RowArrays
        The rows of the result.
    """
    last = None
    repairs: list[Repair] = []
    lids: list[MistrackedLid] = []
    for piece in pieces:
        take, solution = piece.take, piece.solution
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
        if take.blink is not None:
            arrays.append("blink", take.blink)
        repairs += piece.repairs
        lids += piece.mistracked
        last = take, solution
    assert last is not None
    take, solution = last
    take = replace(
        take,
        times=arrays.mapped("times"),
        positions=arrays.mapped("positions"),
        blink=None if take.blink is None else arrays.mapped("blink"),
    )
    weights = replace(solution.weights, times=take.times, weights=arrays.mapped("weights"))
    pose = Pose(arrays.mapped("rotations"), arrays.mapped("translations"))
    distances = arrays.mapped("distances")
    seen, head_markers = ~np.isnan(distances), known.estimates.head_markers
    posed = shows_pose(take, seen, solution.head, head_markers)
    whole = replace(
        solution,
        weights=weights,
        pose=pose.bridged(posed),
        residual=arrays.mapped("residual"),
        feature_points=arrays.mapped("feature_points"),
        distances=distances,
    )
    mended, mistracked = _mended(repairs), joined_lids(lids)
    own = (*repair_findings(mended), *mistracked_findings(mistracked))
    of_all_frames = _of_all_frames(solution.markers, seen, posed, take.source)
    findings = (*own, *known.findings, *of_all_frames)
    return SolvedShot(take, weights, whole, mended, findings, known.lids, mistracked)


def _of_all_frames(
    markers: tuple[str, ...], seen: BoolArray, posed: BoolArray, source: str
) -> list[Finding]:
    """Return the findings that count frames: of markers `seen` (F, M), and `posed` ones (F,)."""
    found = occlusions(markers, (~seen).sum(axis=0), len(seen))
    return found + head_markers_few(posed, source) + unsolved_frames(seen, source)


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
