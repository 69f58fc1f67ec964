"""Weights, head pose and occluded markers of a whole take, solved together.

The head pose is found with the weights because brows, lids and jaw move with the
expression: a rigid fit on face markers alone puts a tenth of a weight into the answer.
Weights and pose are solved in rounds (`usdface.retarget.solve_round`). Once they have settled the
covariance of the weights is learned, and then the error of a noisy neutral is estimated, too
(`usdface.retarget.neutral_error`).
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose, similarity_fit
from usdface.progress import Progress, Step
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.neutral import on_plane
from usdface.retarget.neutral_error import bootstrap_residual, neutral_correction
from usdface.retarget.pins import pin_bounds
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solve_problem import SolveProblem
from usdface.retarget.solve_round import ObservedTake, SolveRound, measured, next_round
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.noise import independent_lags
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.residual_space import ResidualSpace
from usdface.retarget.solver.solve import reach
from usdface.retarget.take_rows import TakeRows
from usdface.setup.pin import Pin
from usdface.takes import visible

__all__ = ["PoseAndWeights", "reach_of_ends", "solve_pose_and_weights"]

# A bound on time. With 30 a take with gaps ends before its neutral is corrected four times: where
# ten markers are occluded for half a second, weights of the small world of the tests are then off
# by 4 to 8 % more than without the gap, with 40 by 0 to 2 %.
_ROUNDS = 40
# Corrections of the neutral. Weight errors by the exact ones after 2, 3 and 4 of them (5 frames of
# 0.3 mm, ICT face, python -m benchmarks.known_answer): 0.44, 0.42, 0.41.
_NEUTRAL_STEPS = 4


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
    problem: SolveProblem,
    *,
    errors: FloatArray | None = None,
    neutral_counts: IntArray | None = None,
    rounds: int = _ROUNDS,
    known: Regularisation | None = None,
    exactly: bool = False,
    progress: Progress | None = None,
) -> PoseAndWeights:
    """Solve the weights of a take, and the head pose if the setup requests it.

    Parameters
    ----------
    problem : SolveProblem
    errors : (M,) float64 [1], optional
        Of the markers (`usdface.retarget.marker_errors`); equal, if left out.
    neutral_counts : (M,) int64, optional
        Number of frames that each marker's neutral is the mean of; None where it is known exactly.
    rounds : int
        At most.
    known : Regularisation, optional
        With noise, misfit and covariance of the take that these frames are a part of; they are
        estimated, if left out.
    exactly : bool
        Do all rounds, also where these frames have settled.
    progress : Progress, optional
        Announces each round of the step "solve".
    """
    target, model, setup = problem.target, problem.model, problem.setup
    axes = problem.positions.shape[2]
    rows = TakeRows.of(MotionModel(target, model, axes, setup.head == "solve"), errors)
    take = _observed_take(problem, rows, known is None)
    regularisation = known or Regularisation(
        0.0, 0.0, setup.solve, problem.free_names, size=rms_radius(target)
    )
    in_head, no_residual = problem.pose.to_head(take.markers), np.zeros(take.occluded.shape)
    state = SolveRound(0, problem.pose, in_head, problem.space, regularisation, no_residual)
    neutral = None
    if neutral_counts is not None and rows.axes == 3:
        start, no_correction = problem.space.start, np.zeros((len(target), 3))
        neutral = _Neutral(target, neutral_counts, start, no_correction, _NEUTRAL_STEPS)
    if take.linear is None and take.seen.all() and not (neutral or exactly):
        state = measured(take, state)
    else:
        state = _alternated(take, state, neutral, rounds, exactly, progress)
    displaced, observed = state.displaced(take, state.iterate)
    regularisation = _learned(take, replace(state, observed=observed)).regularisation
    solved = replace(state, observed=observed, regularisation=regularisation)
    weights, leftover = _final_weights(take, solved, setup.pins)
    if rows.axes == 2:
        # The head motion of a 2D take cannot be undone in depth: small motions are projected out of
        # the markers on the character instead.
        displaced[..., :2] -= leftover.reshape(*take.seen.shape, 2)
    return PoseAndWeights(
        model.complete(weights), state.pose, displaced, regularisation, state.number, state.space
    )


def _observed_take(problem: SolveProblem, rows: TakeRows, is_measured: bool) -> ObservedTake:
    """Return the observed take, which all rounds share."""
    seen = visible(problem.positions)
    residual_space = None
    if is_measured:
        coordinates, lags = np.repeat(seen, rows.axes, axis=1), independent_lags(problem.times)
        residual_space = ResidualSpace.beside_head(
            rows.weighted.directions, rows.weighted_rigid, problem.target, coordinates, lags
        )
    fit_pose = rows.axes == 3 and rows.rigid.shape[1] > 0
    linear = similarity_fit(problem.space.centres, problem.target)[0] if fit_pose else None
    markers = on_plane(problem.positions)
    return ObservedTake(
        problem.times, markers, seen, rows, linear, residual_space, problem.least_noise
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Neutral:
    """A noisy neutral, and the displacement of all frames that its error has been found to be.

    Attributes
    ----------
    target : (M, 3) float64 [m]
    counts : (M,) int64
        Of the frames that each marker's neutral is the mean of.
    start : (M, 3) float64 [m] or None
        Of the space map, without the correction.
    correction : (M, 3) float64 [m]
    steps : int
        Corrections that are left.
    """

    target: FloatArray
    counts: IntArray
    start: FloatArray | None
    correction: FloatArray
    steps: int

    def corrected(self, take: ObservedTake, state: SolveRound) -> "_Neutral":
        """Return it with the correction by the mean residual of the take."""
        assert state.iterate is not None  # after a round
        regularisation = state.regularisation
        leftover = state.residual.reshape(*take.seen.shape, -1) - bootstrap_residual(
            take.rows, self.target, take.seen, take.times, regularisation, state.iterate
        )
        correction = neutral_correction(
            self.correction, leftover, take.seen, self.counts, regularisation, take.rows.rigid
        )
        return replace(self, correction=correction, steps=self.steps - 1)

    def begun(self, state: SolveRound) -> SolveRound:
        """Return the state with the correction, for rounds that learn the covariance anew."""
        start = self.correction if self.start is None else self.start + self.correction
        space = replace(state.space, start=start)
        return replace(state, space=space, regularisation=state.regularisation.unlearned())


def _alternated(
    take: ObservedTake,
    state: SolveRound,
    neutral: _Neutral | None,
    rounds: int,
    exactly: bool,
    progress: Progress | None,
) -> SolveRound:
    """Return the state after rounds that settle, learn the covariance and correct the neutral."""
    for done in range(rounds):
        if progress:  # at most so far: the rounds end when markers have settled
            progress(Step("solve", done / rounds))
        state = next_round(take, state)
        if exactly or not state.settled(take):
            continue
        learned = _learned(take, state)
        if learned is not state:
            state = learned
            continue
        if neutral is None or not neutral.steps:
            break
        neutral = neutral.corrected(take, state)
        state = neutral.begun(state)
    return state


def _learned(take: ObservedTake, state: SolveRound) -> SolveRound:
    """Return the state with the covariance of its weights; itself where there is one, or none."""
    if take.residual_space is None or state.regularisation.covariance is not None:
        return state
    found = take.rows.learned(state.observed, take.times, state.regularisation, state.iterate)
    return state if found.covariance is None else replace(state, regularisation=found)


def _final_weights(
    take: ObservedTake, solved: SolveRound, pins: tuple[Pin, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return the free weights (F, P), with pins, and the head motion that is left (F, M * axes).

    Pins leave the head where the markers have it. If it moved along, a jaw that is pinned would
    tilt it in the equations, and the brows would go with it.
    """
    rows, observed, regularisation = take.rows, solved.observed, solved.regularisation
    bounds = Bounds(rows=rows.model.limit_rows)
    final = rows.solve(observed, take.times, regularisation, solved.iterate, bounds)
    leftover = rows.rigid_part(observed - rows.displacements(final.weights))
    if pins:
        names, limits = regularisation.names, rows.model.limit_rows
        bounds = pin_bounds(pins, names, take.times, final.weights, limits)
        final = rows.with_still_head().solve(
            observed - leftover, take.times, regularisation, final, bounds
        )
    return final.weights, leftover


def reach_of_ends(
    times: FloatArray,
    motion: MotionModel,
    known: Regularisation,
    rounds: int,
    errors: FloatArray | None,
) -> int:
    """Return after how many frames the end of a take has no effect, in a linear solve.

    Parameters
    ----------
    times : (F,) float64 [s]
        Of some frames at the take's rate.
    motion : MotionModel
        Of its markers.
    known : Regularisation
    rounds : int
    errors : (M,) float64 [1], optional
        As of `solve_pose_and_weights`.
    """
    rows = TakeRows.of(motion, errors)
    normal, _ = rows.equations(np.zeros((1, rows.model.offsets.shape[1])))
    return reach(normal, times, known, rounds, rows.model.limit_rows)
