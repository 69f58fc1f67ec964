"""The main job on arrays: a shot cleaned, solved and corrected."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.advice import advice
from usdface.arrays import BoolArray, FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.blend_shape_evaluator import with_combinations
from usdface.closure.closure_layer import Closure, close_eyes_and_lips
from usdface.correction.expression_layer import Correction, express
from usdface.correction.feature_extraction import sided_features
from usdface.correction.gains import Gains
from usdface.errors import InputError, did_you_mean
from usdface.face.bound_face import BoundFace
from usdface.face.region_residuals import region_residuals
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.hooks import Hook, run_hooks
from usdface.options import CleanOptions, ProcessOptions
from usdface.progress import OnProgress, Progress
from usdface.retarget.exaggeration import exaggerated
from usdface.retarget.head_motion import head_motion
from usdface.retarget.pins import faded_at_pins, with_pins
from usdface.retarget.solution import Solution
from usdface.retarget_take import clean, solve
from usdface.shot import Shot, ShotResult
from usdface.solve_errors import solve_errors
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = ["correct", "retarget"]


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
    'disgust'
    """
    progress = Progress.of(on_progress)
    shot = _with_overrides(shot, options)
    take, findings = run_hooks(hooks, "take_read", shot.take, shot)
    shot = replace(shot, take=take)
    face = shot.face
    with progress.step("clean"):
        take, cleaned, new_findings = clean(shot.take, shot.setup)
        shot = replace(shot, take=take)
    findings += new_findings
    with progress.step("solve"):
        weights, solution, new_findings = solve(
            take, face, shot.setup, cleaned=cleaned, progress=progress
        )
        findings += new_findings
        weights = exaggerated(
            weights,
            shot.factors,
            shot.mesh,
            shot.layout,
            pins=shot.setup.pins,
            limits=shot.setup.solve.limits,
        )
        weights, new_findings = run_hooks(hooks, "weights_solved", weights, shot)
        regions, failed = _region_residuals(face, solution)
        findings += new_findings + failed
        result = ShotResult(
            shot,
            _with_pinned_base(shot, weights),
            solution=solution,
            head_motion=_head_motion(shot, face, solution) if options.head else None,
            repairs=cleaned.repairs if cleaned else (),
            region_residuals=regions,
        )
    corrected = correct(result, options=options, hooks=hooks, on_progress=progress)
    return replace(corrected, findings=(*findings, *corrected.findings))


@one_blas_thread()
@solve_errors()
def correct(
    result: ShotResult,
    *,
    gains: Mapping[str, float] | None = None,
    options: ProcessOptions = ProcessOptions(),
    hooks: Sequence[Hook] = (),
    on_progress: OnProgress | Progress | None = None,
) -> ShotResult:
    """Correct the solved weights of a shot, again or with other gains: nothing is solved.

    Parameters
    ----------
    result : ShotResult
        An earlier correction in it is replaced.
    gains : mapping of emotion to float, optional
        Constant factors on the poses of emotions, in place of the shot's; those not named stay.
    options : ProcessOptions
        `express`, `closure` and `trace` have an effect.
    hooks : sequence of Hook, optional
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job.

    Returns
    -------
    ShotResult
        With the findings of the correction alone.

    Raises
    ------
    InputError
        If the shot has no such emotion, or a gain is below 0 or no number.
    PluginError
        If a hook fails.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda").value
    >>> without_joy = usdface.correct(result, gains={"joy": 0.0})
    >>> smile = result.weights.names.index("mouthSmileLeft")
    >>> bool((without_joy.weights.weights[:, smile] <= result.weights.weights[:, smile]).all())
    True
    """
    progress = Progress.of(on_progress)
    shot = _with_gains(result.shot, gains or {})
    result = replace(result, shot=shot, corrected=None, closure=None, trace=None)
    face = shot.face
    findings: list[Finding] = []
    if options.express and (shot.system is None or not shot.expressions):
        findings.append(finding("EXPRESS_SKIPPED", ""))
    elif options.express:
        with progress.step("express"):
            expressed = _express(face, result, trace=options.trace)
            findings += expressed.findings
            weights, new_findings = _after_correction(result, expressed, hooks)
            findings += new_findings
            result = replace(result, corrected=weights, trace=expressed.trace)
    if options.closure:
        with progress.step("closure"):
            closure = _close(face, result)
            findings += closure.findings if closure else ()
            result = replace(result, closure=closure)
    return replace(result, findings=tuple(findings))


def _after_correction(
    result: ShotResult, expressed: Correction, hooks: Sequence[Hook]
) -> tuple[FloatArray, list[Finding]]:
    """Return corrected weights with pins, combinations and hooks."""
    shot, solved = result.shot, result.solved
    pinned = faded_at_pins(
        shot.setup.pins, solved.names, solved.times, solved.weights, expressed.weights
    )
    combined = with_combinations(shot.mesh, solved.names, pinned)
    corrected = replace(solved, weights=combined)
    corrected, findings = run_hooks(hooks, "weights_corrected", corrected, shot)
    return corrected.weights, findings


def _with_gains(shot: Shot, gains: Mapping[str, float]) -> Shot:
    """Return the shot with other gains of some emotions."""
    if not gains:
        return shot
    emotions = [expression.name for expression in shot.expressions]
    for name in gains:
        if name not in emotions:
            raise InputError(
                f"there is no emotion {name!r}{did_you_mean(name, emotions)}; the shot has "
                f"{', '.join(emotions) or 'none'}",
                "SETTING_WRONG",
            )
    present = shot.gains
    if present is None:
        present = Gains.constant(shot.system.gain if shot.system else 1.0, shot.expressions)
    changed = {name: np.array([float(gain)]) for name, gain in gains.items()}
    return replace(shot, gains=replace(present, emotions={**present.emotions, **changed}))


def _with_overrides(shot: Shot, options: ProcessOptions) -> Shot:
    """Return the shot with the options of this run."""
    setup, exaggeration = shot.setup, shot.factors.with_constant(options.exaggeration)
    if not options.clean:
        setup = replace(setup, clean=CleanOptions(swaps=False, spikes=False, gaps=False))
    if options.solve is not None:
        setup = replace(setup, solve=replace(setup.solve, mode=options.solve))
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


def _express(face: BoundFace, result: ShotResult, *, trace: bool) -> Correction:
    shot = result.shot
    assert shot.system is not None
    features = sided_features(
        shot.system,
        face,
        shot.take,
        weights=result.solved,
        solution=result.solution,
        sides=face.layout.sides,
    )
    return express(
        shot.system,
        features,
        face,
        names=result.solved.names,
        weights=result.solved.weights,
        expressions=shot.expressions,
        gains=shot.gains,
        times=shot.take.times,
        trace=trace,
    )


def _close(face: BoundFace, result: ShotResult) -> Closure | None:
    closure = close_eyes_and_lips(
        face,
        result.solved,
        result.weights.weights,
        solution=result.solution,
        pins=result.shot.setup.pins,
        options=result.shot.setup.closure,
    )
    if closure is None:
        return None
    complete = with_combinations(face.mesh, result.solved.names, closure.weights)
    return replace(closure, weights=complete)


def _head_motion(shot: Shot, face: BoundFace, solution: Solution | None) -> Pose | None:
    setup = shot.setup
    if solution is None or not solution.in_space:
        return None
    if not setup.move_head or setup.head == "stabilised":
        return None
    target = face.mesh.points[face.vertices_of(solution.markers)]
    return head_motion(
        solution.pose,
        solution.weights.times,
        solution.neutral,
        target,
        solution.noise,
        _head_seen(shot, solution),
    )


def _head_seen(shot: Shot, solution: Solution) -> BoolArray:
    """Return which markers determine the head's pose: (F, M) bool."""
    seen = ~np.isnan(solution.distances)
    if shot.setup.head == "markers" and isinstance(shot.take, MarkerTake):
        rigid = visible(shot.take.select(shot.setup.head_markers)).sum(axis=1) >= 3
        seen = np.broadcast_to(rigid[:, None], seen.shape)
    return seen
