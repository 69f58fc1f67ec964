"""Weights, head pose and occluded markers of a whole take, solved together.

The head pose is found with the weights because brows, lids and jaw move with the
expression: a rigid fit on face markers alone puts a tenth of a weight into the answer.
Each round solves the weights with small head motions projected out of the problem (so that
one normal matrix serves the whole take), then takes the residual as the pose's error.
Occluded markers follow the same rounds: they are filled with the rig's prediction and the residual
that they had before and have after (`usdface.retarget.carried_residual`).

Once they have settled the error of a noisy neutral is estimated, too
(`usdface.retarget.neutral_error`).
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.geometry.gap_interpolation import interpolate_gaps
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose, rigid_fit, similarity_fit
from usdface.progress import Progress, Step
from usdface.retarget.carried_residual import carried_residual
from usdface.retarget.neutral import on_plane
from usdface.retarget.neutral_error import bootstrap_residual, neutral_correction
from usdface.retarget.pins import pin_bounds
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.noise import Unexplained, frames_apart
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import Iterate, reach
from usdface.retarget.take_rows import TakeRows
from usdface.retarget_setup import Pin, RetargetSetup
from usdface.takes import visible

__all__ = ["PoseAndWeights", "reach_of_ends", "solve_pose_and_weights"]

# A bound on time. With 30 a take with gaps ends before its neutral is corrected four times: where
# ten markers are hidden for half a second, weights of the small world of the tests are then off by
# 4 to 8 % more than without the gap, with 40 by 0 to 2 %.
_ROUNDS = 40
# First rounds, in which occluded markers are interpolated in time, until the head's pose has
# settled. What they are filled with in a wrong pose is kept for long: a gap of 5 frames over
# AnimFace's open jaw steps by 1.6 mm with 4 of these rounds, by 0.09 mm with 10.
_HELD = 10
# Rounds in which noise is estimated: then the pose's own error is far below it.
_NOISE_ROUNDS = 4
# Corrections of the neutral. Weight errors by the exact ones after 2, 3 and 4 of them (5 frames of
# 0.3 mm, ICT face, python -m benchmarks.known_answer): 0.44, 0.42, 0.41.
_NEUTRAL_STEPS = 4
# The rounds end when markers on the character move by less than this share of their error, or this
# far [m]: further rounds would change weights by a hundredth of their error.
_SETTLED_SHARE = 0.01
_SETTLED = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class PoseAndWeights:
    """The joint solution.

    Attributes
    ----------
    weights : (F, S) float64
    pose : Pose
    displaced : (F, M, 3) float64 [m]
        Displacement of the markers from neutral on the character, NaN where occluded.
    regularisation : Regularisation
        With noise, misfit (that of an expressive frame) and covariance as found in the take.
    rounds : int
    space : SpaceMap
        Its start with the correction of the neutral.
    """

    weights: FloatArray
    pose: Pose
    displaced: FloatArray
    regularisation: Regularisation
    rounds: int
    space: SpaceMap


def solve_pose_and_weights(
    times: FloatArray,
    positions: FloatArray,
    target: FloatArray,
    model: BlendShapeEvaluator,
    space: SpaceMap,
    pose: Pose,
    setup: RetargetSetup,
    names: tuple[str, ...] = (),
    *,
    neutral_frames: IntArray | None = None,
    rounds: int = _ROUNDS,
    least_noise: float = 0.0,
    known: Regularisation | None = None,
    exactly: bool = False,
    progress: Progress | None = None,
) -> PoseAndWeights:
    """Solve the weights of a take, and the head pose if the setup requests it.

    Parameters
    ----------
    times : (F,) float64 [s]
    positions : (F, M, D) float64
        NaN where occluded.
    target : (M, 3) float64 [m]
        Neutral feature points on the character.
    model : BlendShapeEvaluator
        Of their displacements by the blend shapes: S shapes, 3 M coordinates.
    space : SpaceMap
        From the performer's neutral (its centres) to `target`.
    pose : Pose
        A first guess, or the pose where it is known.
    setup : RetargetSetup
    names : tuple of str, length S
        The blend shapes; needed for pins, symmetry and gaze.
    neutral_frames : (M,) int64, optional
        Number of frames that each marker's neutral is the mean of; None where it is known exactly.
    rounds : int
        At most.
    least_noise : float [m]
        Standard deviation of a marker coordinate, as far as it is known before.
    known : Regularisation, optional
        With noise, misfit and covariance of the take that these frames are a part of; they are
        estimated, if left out.
    exactly : bool
        Do all rounds, also where these frames have settled.
    progress : Progress, optional
        Announces each round of the step "solve".
    """
    free = tuple(names[shape] for shape in model.free) if names else ()
    rows = TakeRows.of(target, model, positions.shape[2], setup.head == "solve")
    markers, seen = on_plane(positions), visible(positions)
    fit_pose = setup.head == "solve" and rows.axes == 3
    over = similarity_fit(space.centres, target)[0] if fit_pose else np.eye(3)
    back = np.linalg.inv(over)

    hidden = np.repeat(~seen, rows.axes, axis=1)
    here = pose.to_head(markers)
    rest = None
    if known is None:
        coordinates, apart = np.repeat(seen, rows.axes, axis=1), frames_apart(times)
        rest = Unexplained.beside_head(
            rows.model.directions, rows.rigid, target, coordinates, apart
        )

    iterate: Iterate | None = None
    least_misfit = 0.0
    carried = np.zeros((len(times), rows.axes * len(target)))
    regularisation = known or Regularisation(0.0, 0.0, setup.solve, free, size=rms_radius(target))
    bounds = Bounds(rows=rows.model.limit_rows)
    to_correct = 0 if neutral_frames is None or rows.axes == 2 else _NEUTRAL_STEPS
    correction = np.zeros((len(target), 3))
    start = correction if space.start is None else space.start
    for done in range(1, rounds + 1):
        if progress:  # at most so far: the rounds end when markers have settled
            progress(Step("solve", (done - 1) / rounds))
        held = iterate if done > _HELD else None
        displaced, observed = _displaced(here, space, rows, held, times, carried)
        if rest is not None:
            noise = regularisation.noise
            if done <= _NOISE_ROUNDS:
                found = rest.noise(observed)
                noise = max(found, least_noise)
                least_misfit = rest.least_misfit(observed, found)
            # An error of the pose in the first rounds resembles misfit.
            misfit = max(rest.misfit(observed, noise), least_misfit)
            regularisation = replace(regularisation, noise=noise, misfit=misfit)
        if not (fit_pose or to_correct or exactly) and seen.all():
            break
        iterate = rows.solve(observed, times, regularisation, iterate)
        residual = observed - rows.displacements(iterate.weights)
        # Over all coordinates, as the error is: what fills few markers changes few.
        moved = _rms(np.where(hidden, residual - carried, 0.0))
        if hidden.any():
            carried = carried_residual(
                residual, hidden, times, noise=regularisation.noise, misfit=regularisation.misfit
            )
        leftover = residual.reshape(*seen.shape, -1)
        if fit_pose:
            pose = _pose_of(
                pose,
                here,
                markers,
                space.centres + observed.reshape(leftover.shape) @ back,
                leftover @ back,
            )
            before, here = here, pose.to_head(markers)
            moved = max(moved, _rms((here - before)[seen] @ over))
        error = max(regularisation.noise, regularisation.misfit)
        settled = moved < max(_SETTLED_SHARE * error, _SETTLED)
        if settled and not exactly and (done > _HELD or not hidden.any()):
            if known is None and regularisation.covariance is None:
                regularisation = rows.learned(observed, times, regularisation, iterate)
                if regularisation.covariance is not None:
                    continue
            if not (to_correct and neutral_frames is not None):
                break
            to_correct -= 1
            leftover -= bootstrap_residual(rows, target, seen, times, regularisation, iterate)
            correction = neutral_correction(
                correction, leftover, seen, neutral_frames, regularisation, rows.rigid
            )
            space = replace(space, start=start + correction)
            regularisation = regularisation.unlearned()
    displaced, observed = _displaced(here, space, rows, iterate, times, carried)
    if known is None and regularisation.covariance is None:
        regularisation = rows.learned(observed, times, regularisation, iterate)
    weights = _final_weights(rows, observed, times, regularisation, iterate, bounds, setup.pins)
    if rows.axes == 2:
        # The head motion of a 2D take cannot be undone in depth: small motions are projected out of
        # the markers on the character instead.
        leftover = (observed - rows.displacements(weights)) @ rows.rigid @ rows.rigid.T
        displaced[..., :2] -= leftover.reshape(*seen.shape, 2)
    return PoseAndWeights(model.complete(weights), pose, displaced, regularisation, done, space)


def _final_weights(
    rows: TakeRows,
    observed: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    start: Iterate | None,
    bounds: Bounds,
    pins: tuple[Pin, ...],
) -> FloatArray:
    """Return the free weights (F, P) of displacements (F, M * axes), with pins."""
    final = rows.solve(observed, times, regularisation, start, bounds)
    if pins:
        names, limits = regularisation.names, rows.model.limit_rows
        bounds = pin_bounds(pins, names, times, final.weights, limits)
        final = rows.solve(observed, times, regularisation, final, bounds)
    return final.weights


def reach_of_ends(
    times: FloatArray,
    target: FloatArray,
    model: BlendShapeEvaluator,
    axes: int,
    moving_head: bool,
    known: Regularisation,
    rounds: int,
) -> int:
    """Return after how many frames the end of a take has no effect, in a linear solve.

    Parameters
    ----------
    times : (F,) float64 [s]
        Of some frames at the take's rate.
    target, model
        As of `solve_pose_and_weights`.
    axes : int
        Of a marker, 2 or 3.
    moving_head : bool
    known : Regularisation
    rounds : int
    """
    rows = TakeRows.of(target, model, axes, moving_head)
    normal, _ = rows.equations(np.zeros((1, rows.model.offsets.shape[1])))
    return reach(normal, times, known, rounds, rows.model.limit_rows)


def _pose_of(
    pose: Pose, here: FloatArray, markers: FloatArray, expected: FloatArray, residual: FloatArray
) -> Pose:
    """Return the head's pose of markers (F, M, 3) without their residual.

    Occluded markers of a frame in which others determine a pose take part where they are expected,
    so that the pose does not jump as they vanish. `here`, `expected` and `residual` are in the
    frame of a still head.
    """
    seen = visible(markers)
    there = np.where(seen[..., None], here, expected)
    posed = seen.sum(axis=1) >= POSE_MARKERS
    if not posed.any():  # a piece of a take, without the face
        return pose
    kept = np.where(posed[:, None, None], pose.to_take(there), np.nan)
    return rigid_fit(there - residual, np.where(seen[..., None], markers, kept))[0]


def _displaced(
    here: FloatArray,
    space: SpaceMap,
    rows: TakeRows,
    iterate: Iterate | None,
    times: FloatArray,
    carried: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Carry markers of a still head over to the character.

    Return them (F, M, 3) with gaps, and flat (F, N) without.
    """
    displaced = space.displacements(here[..., : rows.axes])
    observed = displaced[..., : rows.axes].reshape(len(displaced), -1)
    hidden = np.isnan(observed)
    if not hidden.any():
        return displaced, observed
    if iterate is None:
        # A marker that no frame of a piece shows begins at rest.
        return displaced, np.nan_to_num(interpolate_gaps(observed, hidden, times))
    return displaced, np.where(hidden, rows.displacements(iterate.weights) + carried, observed)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
