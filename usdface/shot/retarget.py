"""The main job on arrays: a shot cleaned, solved and corrected."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from usdface.advice import advice
from usdface.arguments import checked
from usdface.arrays import FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.face.bound_face import BoundFace
from usdface.face.region_residuals import region_residuals
from usdface.findings import Finding, finding, timed
from usdface.hooks import Hook, run_hooks
from usdface.numerics.solve_errors import solve_errors
from usdface.options import CleanOptions, ProcessOptions
from usdface.progress import OnProgress, Progress
from usdface.retarget.exaggeration import exaggerated
from usdface.retarget.head_motion import turned_at_neutral
from usdface.retarget.pins import check_pins, with_pins
from usdface.retarget.recorded_eyes import recorded_eyes
from usdface.retarget.recorded_gaze import gaze_pins
from usdface.retarget.solution import Solution
from usdface.shot.character_head import character_head
from usdface.shot.correct import check_gains, correct_solved, with_gains
from usdface.shot.run import RetargetRun
from usdface.shot.shot import Shot, ShotResult, SolvedShot
from usdface.shot.solve import solve_shot
from usdface.shot.stage_inputs import express_inputs, solve_inputs
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["express_again", "retarget", "retarget_run", "with_overrides"]

ValueT = TypeVar("ValueT")


@checked
@one_blas_thread()
@solve_errors()
def retarget(
    shot: Shot,
    *,
    options: ProcessOptions = ProcessOptions(),
    hooks: Sequence[Hook] = (),
    on_progress: OnProgress | Progress | None = None,
) -> ShotResult:
    """Clean a shot's markers, solve its weights and correct them: no file, no stage.

    Parameters
    ----------
    shot : Shot
    options : ProcessOptions
        Overrides of the shot's settings for this run.
    hooks : sequence of Hook, optional
        Functions between the steps; `installed_hooks` returns those of installed packages.
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job.

    Returns
    -------
    ShotResult

    Raises
    ------
    InputError
        If setup, take and rig do not belong together.
    SolveError
        If the markers do not determine a solution.
    PluginError
        If a hook fails.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> take, _ = usdface.read_take("examples/take.usdc")
    >>> setup, _ = usdface.read_bind("examples/bind.json")
    >>> shot, _ = usdface.assemble_shot(rig, take, setup=setup)
    >>> result = usdface.retarget(shot)
    >>> result.weights.weights.shape == (len(take.times), len(shot.mesh.shape_names))
    True
    >>> peaks = {name: float(curve.max()) for name, curve in result.emotions.items()}
    >>> max(peaks, key=peaks.get)
    'anger'
    """
    run = RetargetRun(options=options, hooks=hooks, progress=Progress.of(on_progress))
    return retarget_run(shot, run)


@one_blas_thread()
@solve_errors()
def retarget_run(shot: Shot, run: RetargetRun) -> ShotResult:
    """Retarget a shot, with stages that an earlier run may have computed; see `retarget`.

    With hooks nothing is cached: their inputs are unknown.
    """
    names = {*shot.rig.shape_names, *shot.mesh.shape_names}
    check_pins(shot.setup.pins, names, len(shot.take.times))
    check_gains(shot, run.options.gains)
    shot = with_overrides(shot, run.options)
    if run.hooks:
        run = run.uncached
    solved = run.stages.stage("solve", solve_inputs(shot), {}, lambda: solve_shot(shot, run))
    shot = with_gains(replace(shot, take=solved.take), run.options.gains)
    run = replace(run, options=replace(run.options, gains={}))

    def compute() -> ShotResult:
        with run.progress.step("solve"):
            result = _exaggerated_shot(shot, solved, run)
        return _corrected(result, run)

    if run.options.trace:  # for an explanation, which is computed once
        return compute()
    inputs = (express_inputs(shot), run.options, solved)
    given = {
        **{"shot": shot, "solution": solved.solution, "solved": solved.weights, "solve": solved},
        **{"system": shot.system, "repairs": solved.repairs},
    }
    return run.stages.stage("express", inputs, given, compute)


@one_blas_thread()
@solve_errors()
def express_again(shot: Shot, solved: SolvedShot, run: RetargetRun) -> ShotResult:
    """Return the result of `retarget`, with the solve of an earlier run.

    Parameters
    ----------
    shot : Shot
        Expressions, rules, gains, exaggeration and closure may differ from those of that run.
    solved : SolvedShot
        Of the same take and rig with the same settings of the solve.
    run : RetargetRun
        Its progress gets no step "solve".
    """
    shot = replace(with_overrides(shot, run.options), take=solved.take)
    shot = with_gains(shot, run.options.gains)
    with run.progress.step("express"):
        result = _exaggerated_shot(shot, solved, run)
    return _corrected(result, run)


def _exaggerated_shot(shot: Shot, solved: SolvedShot, run: RetargetRun) -> ShotResult:
    """Return the result before its correction, with the findings up to there."""
    face, solution = shot.face, solved.solution
    weights = exaggerated(
        solved.weights,
        shot.factors,
        shot.mesh,
        shot.layout,
        pins=shot.setup.pins,
        limits=shot.setup.solve.limits,
    )
    weights, findings = run_hooks(run.hooks, "weights_solved", weights, shot)
    regions, failed = _region_residuals(face, solution)
    motion, new_findings = character_head(shot, face, solution) if run.options.head else (None, [])
    findings += new_findings
    findings += turned_at_neutral(motion, shot.take.source) if motion else []
    findings += _report_followers(shot)
    eyes, new_findings = recorded_eyes(shot.take, shot.rig, face.mesh, shot.setup)
    findings += new_findings
    return ShotResult(
        shot,
        _with_pinned_base(shot, weights),
        solution=solution,
        head_motion=motion,
        eye_motions=eyes,
        repairs=solved.repairs,
        region_residuals=regions,
        findings=(*solved.findings, *findings, *failed),
        solve=solved,
    )


def _corrected(result: ShotResult, run: RetargetRun) -> ShotResult:
    """Correct and close an exaggerated result; its findings stay."""
    corrected = correct_solved(result, run)
    found = (*result.findings, *corrected.findings)
    return replace(corrected, findings=timed(found, result.shot.take.times.tolist()))


def with_overrides(shot: Shot, options: ProcessOptions) -> Shot:
    """Return the shot with the options of this run, and a recorded gaze as pins."""
    setup, exaggeration = shot.setup, shot.factors.with_constant(options.exaggeration)
    if not options.clean:
        setup = replace(
            setup, clean=CleanOptions(blinks=False, swaps=False, spikes=False, gaps=False)
        )
    if options.solve is not None:
        setup = replace(setup, solve=replace(setup.solve, mode=options.solve))
    if isinstance(shot.take, MarkerTake):
        pins = gaze_pins(shot.take, shot.rig.shape_names, setup)
        setup = replace(setup, pins=(*setup.pins, *pins))
    return replace(shot, setup=setup, exaggeration=exaggeration)


def _with_pinned_base(shot: Shot, weights: WeightsTake) -> WeightsTake:
    """Return solved weights over the base weights, with the pins of the base's own blend shapes."""
    complete = shot.with_base(weights.names, weights.weights)
    others = [pin for pin in shot.setup.pins if pin.shape not in weights.names]
    pinned = with_pins(others, complete.names, complete.times, complete.weights)
    return replace(complete, weights=pinned)


def _report_followers(shot: Shot) -> list[Finding]:
    found = shot.followers
    if not found or not isinstance(shot.take, MarkerTake):  # curves drive every mesh by name
        return []
    message = "of other meshes, they move as the face's of the same name: {shapes} as {leads}"
    leads = list(dict.fromkeys(found.values()))
    return [finding("SHAPES_FOLLOW", shot.mesh.path, message, list(found), leads)]


def _region_residuals(
    face: BoundFace, solution: Solution | None
) -> tuple[dict[str, FloatArray], list[Finding]]:
    """Return the residual of each region; it only informs, so none where that fails."""
    if solution is None:
        return {}, []
    return advice(
        "residual by region",
        lambda: region_residuals(face, solution.markers, solution.distances),
        {},
    )
