"""Solve of a piece of a take by the estimates of the whole."""

from dataclasses import replace

import numpy as np

from usdface.errors import SolveError
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.first_pose import first_pose, in_posed_frames, shows_pose
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.pose_and_weights import (
    PoseAndWeights,
    reach_of_ends,
    solve_pose_and_weights,
)
from usdface.retarget.solution import Solution
from usdface.retarget.solve_problem import SolveProblem
from usdface.retarget.solve_take import solution_of
from usdface.retarget.take_estimates import TakeEstimates
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, frame_step, visible

__all__ = ["overlap_frames", "settled", "solve_piece"]

# Frames at a regular rate for which the reach of a piece's end is computed.
_REGULAR = 4096


def solve_piece(
    take: MarkerTake,
    estimates: TakeEstimates,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
) -> Solution:
    """Solve some frames of a take, with the same number of rounds and iterations for each piece.

    Parameters
    ----------
    take : MarkerTake
        The frames, with those around them that `overlap_frames` counts.
    estimates : TakeEstimates
    shape_names : tuple of str, length S
    setup : RetargetSetup
        Its neutral frames do not count.
    """
    solved = _solved(take, estimates, shape_names, setup, exactly=True)
    return solution_of(take, solved, estimates, shape_names, setup.pins)


def settled(
    take: MarkerTake,
    estimates: TakeEstimates,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
) -> TakeEstimates:
    """Return the estimates with the number of rounds after which these frames settle."""
    solved = _solved(take, estimates, shape_names, setup, exactly=False)
    return replace(estimates, rounds=solved.rounds)


def _solved(
    take: MarkerTake,
    estimates: TakeEstimates,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
    exactly: bool,
) -> PoseAndWeights:
    if not estimates.model.linear:
        raise SolveError(
            "blend shapes with inbetweens or combinations are not solved in pieces, since their "
            "steps follow all frames; process the take as a whole",
            "SETTING_WRONG",
        )
    setup = replace(setup, head=estimates.head)
    positions = take.select(estimates.markers)
    if shows_pose(take, visible(positions), setup.head, setup.head_markers).any():
        pose, posed = first_pose(take, positions, estimates.neutral, setup, estimates.head_neutral)
        positions = in_posed_frames(positions, posed)
    else:  # the head was out of sight all the time; other pieces have its pose
        pose, positions = Pose.identity(len(positions)), np.full_like(positions, np.nan)
    known = estimates.regularisation(setup.solve, shape_names)
    if not exactly:
        known = replace(known, options=setup.solve)
    problem = SolveProblem(
        times=take.times,
        positions=positions,
        target=estimates.rest,
        model=estimates.model,
        space=estimates.space,
        pose=pose,
        setup=setup,
        names=shape_names,
    )
    return solve_pose_and_weights(
        problem, rounds=estimates.rounds, errors=estimates.errors, known=known, exactly=exactly
    )


def overlap_frames(
    take: MarkerTake,
    estimates: TakeEstimates,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
) -> int:
    """Return how many frames a piece needs beyond each of its ends.

    By the decay of the equation's inverse in time, over all iterations of all rounds
    (`usdface.retarget.solver.parallel_pieces.overlap`). Parameters are those of `solve_piece`.
    """
    if len(take.times) == 1:
        return 0
    solves = estimates.rounds * (1 if not setup.pins else 2)
    return reach_of_ends(
        np.arange(float(_REGULAR)) * frame_step(take.times),
        MotionModel(estimates.rest, estimates.model, take.dimension, estimates.head == "solve"),
        estimates.regularisation(setup.solve, shape_names),
        solves,
        estimates.errors,
    )
