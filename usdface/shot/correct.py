"""The correction of a solved shot: expressions blended in, then eyes and lips closed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.blend_shapes.combined_weights import with_combinations
from usdface.closure.closed_eyes import lids_not_found
from usdface.closure.closure_layer import Closure, close_eyes_and_lips
from usdface.closure.solved_performance import SolvedPerformance
from usdface.correction.expression_layer import Correction, express
from usdface.correction.feature_extraction import sided_features
from usdface.correction.gains import Gains
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding, finding
from usdface.hooks import Hook, run_hooks
from usdface.numerics.solve_errors import solve_errors
from usdface.options import ProcessOptions
from usdface.progress import OnProgress, Progress
from usdface.retarget.pins import faded_at_pins
from usdface.shot.followers import with_followers
from usdface.shot.run import RetargetRun
from usdface.shot.shot import Shot, ShotResult
from usdface.takes import MarkerTake

__all__ = ["check_gains", "correct", "correct_solved", "with_gains"]


@checked
@one_blas_thread()
@solve_errors()
def correct(
    result: ShotResult,
    *,
    options: ProcessOptions = ProcessOptions(),
    hooks: Sequence[Hook] = (),
    on_progress: OnProgress | Progress | None = None,
) -> ShotResult:
    """Correct the solved weights of a shot again, with other options: nothing is solved.

    Parameters
    ----------
    result : ShotResult
        An earlier correction in it is replaced.
    options : ProcessOptions
        `express`, `closure`, `gains` and `trace` have an effect.
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
        If the shot has no emotion that a gain names.
    PluginError
        If a hook fails.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda").value
    >>> without_joy = usdface.correct(
    ...     result, options=usdface.ProcessOptions(gains={"joy": 0.0})
    ... )
    >>> smile = result.weights.names.index("mouthSmileLeft")
    >>> bool((without_joy.weights.weights[:, smile] <= result.weights.weights[:, smile]).all())
    True
    """
    run = RetargetRun(options=options, hooks=hooks, progress=Progress.of(on_progress))
    return correct_solved(result, run)


def correct_solved(result: ShotResult, run: RetargetRun) -> ShotResult:
    """Correct as `correct`, as a part of a run."""
    options, progress = run.options, run.progress
    shot = with_gains(result.shot, options.gains)
    result = replace(result, shot=shot, corrected=None, closure=None, trace=None)
    face = shot.face
    findings: list[Finding] = []
    system = shot.system if shot.expressions else None
    if options.express and system is None:
        gained = shot.gains and any((curve != 1).any() for curve in shot.gains.emotions.values())
        unused = ", and the gains of emotions change nothing" if gained else ""
        message = f"the shot has no fuzzy system; no express layer is written{unused}"
        findings.append(finding("EXPRESS_SKIPPED", "", message, missing="system"))
    elif system is not None and options.express:
        with progress.step("express"):
            expressed = _express(system, face, result, trace=options.trace)
            findings += expressed.findings
            weights, new_findings = _after_correction(result, expressed, run.hooks)
            findings += new_findings
            result = replace(result, corrected=weights, trace=expressed.trace)
    if options.closure:
        with progress.step("closure"):
            closure = _close(face, result)
            findings += closure.findings if closure else ()
            if result.solution is not None and shot.setup.closure.lids:
                findings += lids_not_found(face, result.solved.names)
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
    combined = with_combinations(shot.mesh.shapes, solved.names, pinned)
    combined = with_followers(shot.followers, solved.names, solved.weights, combined)
    corrected = replace(solved, weights=combined)
    corrected, findings = run_hooks(hooks, "weights_corrected", corrected, shot)
    return corrected.weights, findings


def check_gains(shot: Shot, gains: Mapping[str, float]) -> None:
    """Refuse gains of emotions that a shot does not have.

    Raises
    ------
    InputError
        If the shot has no emotion of that name.
    """
    emotions = [expression.name for expression in shot.expressions]
    for name in gains:
        if name not in emotions:
            raise InputError(
                f"there is no emotion {name!r}; the shot has {', '.join(emotions) or 'none'}"
                f"{did_you_mean(name, emotions)}",
                "SETTING_WRONG",
            )


def with_gains(shot: Shot, gains: Mapping[str, float]) -> Shot:
    """Return the shot with other gains of some emotions; raises as `check_gains`."""
    if not gains:
        return shot
    check_gains(shot, gains)
    present = shot.gains
    if present is None:
        present = Gains.constant(shot.system.gain if shot.system else 1.0, shot.expressions)
    changed = {name: np.array([float(gain)]) for name, gain in gains.items()}
    return replace(shot, gains=replace(present, emotions={**present.emotions, **changed}))


def _express(
    system: ExpressionSystem, face: BoundFace, result: ShotResult, *, trace: bool
) -> Correction:
    shot = result.shot
    features = sided_features(
        system,
        face,
        shot.take,
        weights=result.solved,
        solution=result.solution,
        sides=face.layout.sides,
        expressions=shot.expressions,
        pins=shot.setup.pins,
    )
    return express(
        system,
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
    solve, by_eye = result.solve, None
    # A base adds blend shapes, without which the lids were measured.
    if solve is not None and result.solved.names == solve.weights.names:
        by_eye = solve.lids
    take = result.shot.take
    setup = result.shot.setup
    performance = SolvedPerformance.of(
        face, result.solved, result.solution, setup.pins, result.performed
    )
    closure = close_eyes_and_lips(
        performance,
        result.weights.weights,
        options=setup.closure,
        by_eye=by_eye,
        blink=take.blink if isinstance(take, MarkerTake) else None,
    )
    if closure is None:
        return None
    names, before = result.solved.names, result.weights.weights
    complete = with_combinations(face.mesh.shapes, names, closure.weights)
    complete = with_followers(result.shot.followers, names, before, complete)
    return replace(closure, weights=complete)
