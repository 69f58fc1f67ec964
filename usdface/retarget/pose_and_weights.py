"""Weights, head pose and occluded markers of a whole take, solved together.

The head pose is found with the weights because brows, lids and jaw move with the
expression: a rigid fit on face markers alone puts a tenth of a weight into the answer.
Each round solves the weights with small head motions projected out of the problem (so that
one normal matrix serves the whole take), then takes the residual as the pose's error.
Occluded markers follow the same rounds: they are filled with the rig's prediction.

The neutral is a mean of noisy frames, and the displacements of all frames share its error. Once the
rest has settled it is estimated, too: weights of 0 or more are the envelope that shows it, since a
face at rest that lies below them leaves a residual in most frames.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.geometry.gap_interpolation import interpolate_gaps
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose, rigid_fit, similarity_fit
from usdface.geometry.rigid_modes import motion_basis
from usdface.progress import Progress, Step
from usdface.retarget.bounds import Bounds
from usdface.retarget.neutral import on_plane
from usdface.retarget.noise import Unexplained
from usdface.retarget.nonlinear_solve import first_guess, solve_nonlinear
from usdface.retarget.pins import pin_bounds
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.regularisation import Regularisation
from usdface.retarget.solve import Iterate, reach, solve_weights, with_learned_covariance
from usdface.retarget_setup import RetargetSetup
from usdface.takes import visible

__all__ = ["PoseAndWeights", "reach_of_ends", "solve_pose_and_weights"]

# A bound on time; and steps of a nonlinear solve in a round. Set by hand; docs/constants.md.
_ROUNDS = 30
_ROUGH = 4
# Corrections of the neutral. Weight errors by the exact ones after 2, 3 and 4 of them (5 frames of
# 0.3 mm, ICT face, python -m benchmarks.known_answer): 0.44, 0.42, 0.41.
_NEUTRAL_STEPS = 4
# The rounds end when markers move by less than this share of their error, or this far [m]: further
# rounds would change weights by a hundredth of their error.
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


@dataclass(frozen=True, eq=False, slots=True)
class _Rows:
    """The least-squares rows: displacements of the markers by shapes and by the head.

    Attributes
    ----------
    axes : int
        2 for an image, which has no say on depth; else 3.
    model : BlendShapeEvaluator
        Of M * axes coordinates, P of its shapes with a weight of their own.
    rigid : (M * axes, K) float64
        Orthonormal small head motions, K = 6 or 0.
    """

    axes: int
    model: BlendShapeEvaluator
    rigid: FloatArray

    def displacements(self, weights: FloatArray) -> FloatArray:
        """Return the markers' displacements by free weights (F, P): (F, M * axes)."""
        return self.model.displacements(self.model.complete(weights))


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
        The blend shapes; needed where the setup has pins or asks for symmetry.
    neutral_frames : (M,) int64, optional
        Frames that each marker's neutral is the mean of; None where it is known exactly.
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
    rows = _rows(target, model, positions.shape[2], setup.head == "solve")
    markers, seen = on_plane(positions), visible(positions)
    fit_pose = setup.head == "solve" and rows.axes == 3
    back = np.linalg.inv(similarity_fit(space.centres, target)[0]) if fit_pose else np.eye(3)

    here = pose.to_head(markers)
    rest = None
    if known is None:
        rest = Unexplained.of(
            np.vstack([rows.model.directions, rows.rigid.T]), np.repeat(seen, rows.axes, axis=1)
        )

    iterate: Iterate | None = None
    regularisation = known or Regularisation(0.0, 0.0, setup.solve, free, size=rms_radius(target))
    bounds = Bounds(rows=rows.model.limit_rows, limits=np.zeros(len(rows.model.limit_rows)))
    to_correct = 0 if neutral_frames is None or rows.axes == 2 else _NEUTRAL_STEPS
    correction = np.zeros((len(target), 3))
    start = correction if space.start is None else space.start
    for done in range(1, rounds + 1):
        if progress:  # at most so far: the rounds end when markers have settled
            progress(Step("solve", (done - 1) / rounds))
        displaced, observed = _displaced(here, space, rows, iterate, times)
        if rest is not None:
            noise = max(rest.noise(observed), least_noise) if done <= 2 else regularisation.noise
            # A pose that is off in the first rounds looks like misfit.
            misfit = rest.misfit(observed, noise)
            regularisation = replace(regularisation, noise=noise, misfit=misfit)
        if not (fit_pose or to_correct or exactly) and seen.all():
            break
        iterate = _step(rows, observed, times, regularisation, iterate)
        leftover = (observed - rows.displacements(iterate.weights)).reshape(*seen.shape, -1)
        moved = _rms(leftover[~seen])
        if fit_pose:
            pose, _ = rigid_fit(here - np.where(seen[..., None], leftover, 0.0) @ back, markers)
            before, here = here, pose.to_head(markers)
            moved = max(moved, _rms((here - before)[seen]))
        error = max(regularisation.noise, regularisation.misfit)
        if not exactly and moved < max(_SETTLED_SHARE * error, _SETTLED):
            if known is None and regularisation.covariance is None:
                regularisation = _learned(rows, observed, times, regularisation, iterate)
                if regularisation.covariance is not None:
                    continue
            if not (to_correct and neutral_frames is not None):
                break
            to_correct -= 1
            held_back = _held_back(rows, seen, times, regularisation, iterate)
            correction = _neutral_correction(
                correction, leftover - held_back, seen, neutral_frames, regularisation, rows.rigid
            )
            space = replace(space, start=start + correction)
            regularisation = regularisation.unlearned()
    displaced, observed = _displaced(here, space, rows, iterate, times)
    if known is None and regularisation.covariance is None:
        regularisation = _learned(rows, observed, times, regularisation, iterate)
    final = _step(rows, observed, times, regularisation, iterate, bounds)
    if setup.pins:
        bounds = pin_bounds(setup.pins, free, times, final.weights, rows.model.limit_rows)
        final = _step(rows, observed, times, regularisation, final, bounds)
    weights = final.weights
    if rows.axes == 2:
        # A flat image of a turning head cannot be undone in depth: the motion's small part
        # is taken out of the markers on the character instead.
        leftover = (observed - rows.displacements(weights)) @ rows.rigid @ rows.rigid.T
        displaced[..., :2] -= leftover.reshape(*seen.shape, 2)
    return PoseAndWeights(model.complete(weights), pose, displaced, regularisation, done, space)


def reach_of_ends(
    times: FloatArray,
    target: FloatArray,
    model: BlendShapeEvaluator,
    axes: int,
    moving_head: bool,
    known: Regularisation,
    rounds: int,
) -> int:
    """Return after how many frames nothing is left of the end of a take, in a linear solve.

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
    rows = _rows(target, model, axes, moving_head)
    normal, _ = _equations(rows, np.zeros((1, rows.model.offsets.shape[1])))
    return reach(normal, times, known, rounds, rows.model.limit_rows)


def _rows(target: FloatArray, model: BlendShapeEvaluator, axes: int, moving_head: bool) -> _Rows:
    seen = np.arange(3 * len(target)).reshape(-1, 3)[:, :axes].ravel()
    rigid = motion_basis(target, axes) if moving_head else np.zeros((axes * len(target), 0))
    return _Rows(axes, model.select(seen), rigid)


def _step(
    rows: _Rows,
    observed: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    start: Iterate | None,
    final: Bounds | None = None,
) -> Iterate:
    """Solve the free weights for displacements (F, M * axes).

    Without `final` bounds a few steps are taken only.
    """
    model, rigid, rough = rows.model, rows.rigid, final is None
    bounds = final or Bounds(rows=model.limit_rows, limits=np.zeros(len(model.limit_rows)))
    if model.linear:
        normal, right = _equations(rows, observed)
        return solve_weights(normal, right, times, regularisation, start, rough, bounds)
    start = start or first_guess(model, rigid, observed, times, regularisation)
    steps = {"steps": _ROUGH} if rough else {}
    return solve_nonlinear(model, rigid, observed, times, regularisation, start, bounds, **steps)


def _learned(
    rows: _Rows,
    observed: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    start: Iterate | None,
) -> Regularisation:
    """Learn how the free weights move in this take; without a covariance if it is undetermined."""
    if not rows.model.linear:
        return regularisation
    return with_learned_covariance(*_equations(rows, observed), times, regularisation, start)


def _equations(rows: _Rows, observed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return normal matrix (S, S) and right-hand sides (F, S), without the head's motion."""
    shapes = rows.model.offsets - (rows.model.offsets @ rows.rigid) @ rows.rigid.T
    return shapes @ shapes.T, observed @ shapes.T


def _held_back(
    rows: _Rows,
    seen: BoolArray,
    times: FloatArray,
    regularisation: Regularisation,
    iterate: Iterate,
) -> FloatArray:
    """Return the mean residual (M, axes) [m] that noise leaves where weights cannot fall below 0.

    Measured on a take with the same weights and as much noise, but an exact neutral (parametric
    bootstrap: Efron and Tibshirani 1993, An Introduction to the Bootstrap, 6.5). Markers that are
    not `seen` (F, M) have no noise.
    """
    predicted = rows.displacements(iterate.weights)
    noise = np.random.default_rng(0).standard_normal(predicted.shape)
    noise = np.where(np.repeat(seen, rows.axes, axis=1), regularisation.noise * noise, 0.0)
    simulated = predicted + noise
    again = _step(rows, simulated, times, regularisation, iterate)
    left = (simulated - rows.displacements(again.weights)).reshape(*seen.shape, -1)
    count = np.maximum(seen.sum(axis=0), 1)
    return np.asarray(np.where(seen[..., None], left, 0.0).sum(axis=0) / count[:, None])


def _neutral_correction(
    before: FloatArray,
    leftover: FloatArray,
    seen: BoolArray,
    frames: IntArray,
    regularisation: Regularisation,
    rigid: FloatArray,
) -> FloatArray:
    """Return what to add to all displacements for the neutral's error: (M, 3) [m].

    The neutral is as uncertain as the mean of noisy frames; the mean residual of the take shows its
    error, but for the misfit, which lasts.

    Parameters
    ----------
    before : (M, 3) float64 [m]
        The correction that `leftover` has.
    leftover : (F, M, 3) float64 [m]
        Residuals; any value where `seen` is False.
    frames : (M,) int64
        That each marker's neutral is the mean of.
    """
    noise, misfit = regularisation.noise**2, regularisation.misfit**2
    count = np.maximum(seen.sum(axis=0), 1)
    expected = noise / np.maximum(frames, 1)
    misfit = max(0.0, misfit - float(expected.mean()))  # the neutral's error looks like it
    share = expected / np.maximum(expected + noise / count + misfit, 1e-300)
    mean = np.where(seen[..., None], leftover, 0.0).sum(axis=0) / count[:, None]
    correction = (share[:, None] * (before - mean)).ravel()
    return np.asarray((correction - rigid @ (rigid.T @ correction)).reshape(-1, 3))


def _displaced(
    here: FloatArray,
    space: SpaceMap,
    rows: _Rows,
    iterate: Iterate | None,
    times: FloatArray,
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
    return displaced, np.where(hidden, rows.displacements(iterate.weights), observed)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
