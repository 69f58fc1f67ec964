"""The solve of a shot: its markers cleaned, its weights solved, mistracked lids replaced."""

from collections.abc import Callable, Mapping
from dataclasses import replace

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
from usdface.retarget_take.recorded_weights import recorded_weights
from usdface.retarget_take.solve import solve
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.run import RetargetRun
from usdface.shot.shot import Shot, SolvedShot
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "Solved",
    "TakeSolver",
    "checked_lids",
    "solve_shot",
    "solve_with_replaced_lids",
]

Solved = tuple[Solution, list[Finding]]
TakeSolver = Callable[[MarkerTake], Solved]


def solve_shot(shot: Shot, run: RetargetRun) -> SolvedShot:
    """Clean and solve the take of a shot."""
    recorded = known_digest(replace(shot.take, source=""))
    take, findings = run_hooks(run.hooks, "take_read", shot.take, shot)
    shot = replace(shot, take=take)
    if isinstance(take, MarkerTake):
        solved = _solve_markers(take, shot, run)
    else:
        solved = _take_over(take, shot, run)
    return replace(solved, findings=(*findings, *solved.findings), recorded=recorded)


def _take_over(take: WeightsTake, shot: Shot, run: RetargetRun) -> SolvedShot:
    """Return recorded weights as a solve has them."""
    with run.progress.step("clean"):
        pass  # no markers; steps are those of any shot
    with run.progress.step("solve"):
        weights, findings = recorded_weights(take, shot.face, shot.setup)
    return SolvedShot(take, weights, None, findings=tuple(findings))


def _solve_markers(take: MarkerTake, shot: Shot, run: RetargetRun) -> SolvedShot:
    face, setup = shot.face, shot.setup
    with run.progress.step("clean"):  # or taken from an earlier run, of any character
        cleaned, findings = run.stages.stage(
            "clean", clean_inputs(take, setup), {"take": take}, lambda: clean(take, setup)
        )

    def solved(take: MarkerTake) -> Solved:
        return solve(take, face, setup, cleaned=cleaned, progress=run.progress)

    with run.progress.step("solve"):
        by_eye = checked_lids(face, setup)
        (solution, new_findings), lids = solve_with_replaced_lids(
            cleaned.take, face, by_eye, lid_reach(take.times), solved
        )
    return SolvedShot(
        take=with_replaced_lids(cleaned.take, lids),
        weights=solution.weights,
        solution=solution,
        repairs=cleaned.repairs,
        findings=(*findings, *mistracked_findings(lids), *new_findings),
        lids=by_eye,
        mistracked=lids,
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
    if by_eye is not None:
        lids = mistracked_lids(take, face.with_contacts(), answer[0], by_eye, reach)
    if lids or corrected is not None:
        answer = (corrected or tracked)(with_replaced_lids(take, lids))
    return answer, lids
