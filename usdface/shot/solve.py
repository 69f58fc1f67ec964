"""The solve of a shot: its markers cleaned, its weights solved, mistracked lids replaced."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from usdface.cleanup.clean import Cleaned
from usdface.closure.lid_apertures import Eye, LidApertures, lid_apertures_of
from usdface.closure.mistracked_lids import (
    MistrackedLid,
    lid_reach,
    mistracked_findings,
    mistracked_lids,
    with_replaced_lids,
)
from usdface.content_digest import known_digest
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.hooks import run_hooks
from usdface.retarget.solution import Solution
from usdface.retarget_take.clean import clean, clean_inputs
from usdface.retarget_take.solve import solve
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.run import RetargetRun, Stages
from usdface.shot.shot import Shot, SolvedShot
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "Solved",
    "TakeSolver",
    "checked_lids",
    "solve_shot",
    "solve_with_replaced_lids",
]

Solved = tuple[WeightsTake, Solution | None, list[Finding]]
TakeSolver = Callable[[MarkerTake], Solved]


def solve_shot(shot: Shot, run: RetargetRun) -> SolvedShot:
    """Clean and solve the take of a shot."""
    recorded = known_digest(replace(shot.take, source=""))
    take, findings = run_hooks(run.hooks, "take_read", shot.take, shot)
    shot = replace(shot, take=take)
    face, setup = shot.face, shot.setup
    with run.progress.step("clean"):
        take, cleaned, new_findings = _clean(shot, run.stages)
    findings += new_findings

    def solved(take: MarkerTake | WeightsTake) -> Solved:
        return solve(take, face, setup, cleaned=cleaned, progress=run.progress)

    lids: tuple[MistrackedLid, ...] = ()
    by_eye = None
    with run.progress.step("solve"):
        if isinstance(take, MarkerTake):
            by_eye = checked_lids(face, setup)
            reach = lid_reach(take.times)
            answer, lids = solve_with_replaced_lids(take, face, by_eye, reach, solved)
            take = with_replaced_lids(take, lids)
        else:
            answer = solved(take)
    weights, solution, new_findings = answer
    findings += [*mistracked_findings(lids), *new_findings]
    repairs = cleaned.repairs if cleaned else ()
    return SolvedShot(
        take=take,
        weights=weights,
        solution=solution,
        repairs=repairs,
        findings=tuple(findings),
        lids=by_eye,
        mistracked=lids,
        recorded=recorded,
    )


def checked_lids(face: BoundFace, setup: RetargetSetup) -> Mapping[Eye, LidApertures] | None:
    """Return the lids whose markers are checked; None where the take stays as it was tracked."""
    return lid_apertures_of(face.with_contacts(), face.shape_names) if setup.clean.spikes else None


def solve_with_replaced_lids(
    take: MarkerTake,
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures] | None,
    reach: int,
    tracked: TakeSolver,
    corrected: TakeSolver | None = None,
) -> tuple[Solved, tuple[MistrackedLid, ...]]:
    """Solve a take, find mistracked lids by that solution, and solve it again with these replaced.

    Parameters
    ----------
    take : MarkerTake
        A whole one, or a piece.
    face : BoundFace
    by_eye : mapping of "left", "right" to LidApertures, or None
        As `checked_lids` returns them.
    reach : int
        `lid_reach` of the whole take.
    tracked : callable
        Solves the take as it was tracked.
    corrected : callable, optional
        Solves it with replaced lids, also where none are; `tracked`, if left out.
    """
    answer = tracked(take)
    lids: tuple[MistrackedLid, ...] = ()
    if by_eye is not None and answer[1] is not None:
        lids = mistracked_lids(take, face.with_contacts(), answer[1], by_eye, reach)
    if lids or corrected is not None:
        answer = (corrected or tracked)(with_replaced_lids(take, lids))
    return answer, lids


def _clean(
    shot: Shot, stages: Stages
) -> tuple[MarkerTake | WeightsTake, Cleaned | None, list[Finding]]:
    """Clean the markers of a shot, or take them from an earlier run, of any character."""
    take, setup = shot.take, shot.setup
    if isinstance(take, WeightsTake):
        return take, None, []
    cleaned, findings = stages.stage(
        "clean", clean_inputs(take, setup), {"take": take}, lambda: clean(take, setup)
    )
    return cleaned.take, cleaned, findings
