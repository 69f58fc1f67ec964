"""The main job on arrays: a shot cleaned, solved and corrected."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from usdface.advice import advice
from usdface.arrays import BoolArray, FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.face.bound_face import BoundFace
from usdface.face.region_residuals import region_residuals
from usdface.findings import Finding, timed
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose
from usdface.hooks import Hook, run_hooks
from usdface.numerics.solve_errors import solve_errors
from usdface.options import CleanOptions, ClosureOptions, ProcessOptions
from usdface.progress import OnProgress, Progress
from usdface.retarget.exaggeration import exaggerated
from usdface.retarget.head_motion import head_motion, turned_at_neutral
from usdface.retarget.joint_motion import JointMotion
from usdface.retarget.pins import check_pins, with_pins
from usdface.retarget.recorded_eyes import recorded_eyes, turning_joints
from usdface.retarget.recorded_gaze import gaze_pins
from usdface.retarget.recorded_head import recorded_head
from usdface.retarget.solution import Solution
from usdface.shot.correct import check_gains, correct_solved, with_gains
from usdface.shot.shot import Shot, ShotResult, SolvedShot
from usdface.shot.solve import Stages, Uncached, solve_shot
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = [
    "express_again",
    "retarget",
    "retarget_in_stages",
    "solve_inputs",
    "solve_settings",
    "with_overrides",
]

ValueT = TypeVar("ValueT")


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
    names = {*shot.rig.shape_names, *shot.mesh.shape_names}
    check_pins(shot.setup.pins, names, len(shot.take.times))
    return retarget_in_stages(shot, options, hooks, Progress.of(on_progress), Uncached())


@one_blas_thread()
@solve_errors()
def retarget_in_stages(
    shot: Shot,
    options: ProcessOptions,
    hooks: Sequence[Hook],
    progress: Progress,
    stages: Stages,
) -> ShotResult:
    """Retarget a shot, with stages that an earlier run may have computed.

    Parameters
    ----------
    shot : Shot
    options : ProcessOptions
    hooks : sequence of Hook
        With any, nothing is cached: their inputs are unknown.
    progress : Progress
    stages : Stages
        Returns the value of "solve" and of "express", kept or computed, and within the first that
        of "clean", which other characters may share.
    """
    check_gains(shot, options.gains)
    shot = with_overrides(shot, options)
    if hooks:
        stages = Uncached()
    solved = stages.stage(
        "solve", solve_inputs(shot), {}, lambda: solve_shot(shot, hooks, progress, stages)
    )
    shot = with_gains(replace(shot, take=solved.take), options.gains)
    options = replace(options, gains={})

    def compute() -> ShotResult:
        return _express_shot(shot, solved, options, hooks, progress)

    if options.trace:  # for an explanation, which is computed once
        return compute()
    inputs = (_express_inputs(shot), options, solved)
    given = {
        **{"shot": shot, "solution": solved.solution, "solved": solved.weights, "solve": solved},
        **{"system": shot.system, "repairs": solved.repairs},
    }
    return stages.stage("express", inputs, given, compute)


def solve_inputs(shot: Shot) -> object:
    """Return all that the solve of a shot depends on."""
    return shot.take, solve_settings(shot)


def solve_settings(shot: Shot) -> object:
    """Return all that the solve of a shot depends on beside its take."""
    setup = replace(shot.setup, closure=ClosureOptions(), exaggeration={})
    return shot.mesh, shot.rig.shape_names, setup, shot.layout


def _express_inputs(shot: Shot) -> object:
    """Return all that correction and closure depend on beside the solve."""
    system, names = (shot.system, shot.expressions, shot.layout, shot.gains), shot.rig.shape_names
    # A recorded head turns about its joint, eyes about theirs.
    joints = shot.rig.skeleton, turning_joints(shot.rig, shot.setup)
    return shot.mesh, joints, names, shot.setup, system, shot.base, shot.factors


def _express_shot(
    shot: Shot,
    solved: SolvedShot,
    options: ProcessOptions,
    hooks: Sequence[Hook],
    progress: Progress,
) -> ShotResult:
    """Exaggerate, correct and close the solved weights of a shot, whose take is the cleaned one."""
    with progress.step("solve"):
        result = _exaggerated_shot(shot, solved, options, hooks)
    return _corrected(result, options, hooks, progress)


@one_blas_thread()
@solve_errors()
def express_again(
    shot: Shot,
    solved: SolvedShot,
    options: ProcessOptions,
    hooks: Sequence[Hook],
    progress: Progress,
) -> ShotResult:
    """Return what `retarget` does, with a solve of an earlier run.

    Parameters
    ----------
    shot : Shot
        Expressions, rules, gains, exaggeration and closure may differ from those of that run.
    solved : SolvedShot
        Of the same take and rig with the same settings of the solve.
    options : ProcessOptions
    hooks : sequence of Hook
    progress : Progress
        Gets no step "solve".
    """
    shot = with_gains(replace(with_overrides(shot, options), take=solved.take), options.gains)
    with progress.step("express"):
        result = _exaggerated_shot(shot, solved, options, hooks)
    return _corrected(result, options, hooks, progress)


def _exaggerated_shot(
    shot: Shot, solved: SolvedShot, options: ProcessOptions, hooks: Sequence[Hook]
) -> ShotResult:
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
    weights, findings = run_hooks(hooks, "weights_solved", weights, shot)
    regions, failed = _region_residuals(face, solution)
    motion, new_findings = _head_motion(shot, face, solution) if options.head else (None, [])
    findings += new_findings
    findings += turned_at_neutral(motion, shot.take.source) if motion else []
    eyes, new_findings = _eye_motions(shot, face)
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


def _corrected(
    result: ShotResult, options: ProcessOptions, hooks: Sequence[Hook], progress: Progress
) -> ShotResult:
    """Correct and close an exaggerated result; its findings stay."""
    corrected = correct_solved(result, options, hooks, progress)
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


def _head_motion(
    shot: Shot, face: BoundFace, solution: Solution | None
) -> tuple[Pose | None, list[Finding]]:
    setup = shot.setup
    if not setup.move_head or setup.head == "stabilised":
        return None, []
    if isinstance(shot.take, WeightsTake):
        return recorded_head(shot.take, shot.rig, face.mesh, setup)
    if solution is None or not solution.posed_in_space:
        return None, []
    target = face.mesh.points[face.vertices_of(solution.markers)]
    motion = head_motion(
        solution.pose,
        solution.weights.times,
        target if solution.filmed else solution.neutral,
        target,
        solution.noise,
        _head_seen(shot, solution),
    )
    return motion, []


def _eye_motions(shot: Shot, face: BoundFace) -> tuple[tuple[JointMotion, ...], list[Finding]]:
    return recorded_eyes(shot.take, shot.rig, face.mesh, shot.setup)


def _head_seen(shot: Shot, solution: Solution) -> BoolArray:
    """Return which markers determine the head's pose: (F, M) bool."""
    seen = ~np.isnan(solution.distances)
    if solution.head == "markers" and isinstance(shot.take, MarkerTake):
        rigid = visible(shot.take.select(shot.setup.head_markers)).sum(axis=1) >= POSE_MARKERS
        seen = np.broadcast_to(rigid[:, None], seen.shape)
    return seen
