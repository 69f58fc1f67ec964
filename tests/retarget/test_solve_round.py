"""One round of the joint solve: it changes nothing that it is given, and settles at the answer."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.options import MapOptions, SolveOptions
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.rbf import fit_map
from usdface.retarget.solve_round import ObservedTake, SolveRound, measured, next_round
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.take_rows import TakeRows
from usdface.takes import visible

RNG = np.random.default_rng(21)
FRAMES, MARKERS, SHAPES = 60, 24, 5
TIMES = np.arange(FRAMES) / 30
FACE = RNG.normal(size=(MARKERS, 3)) * [0.07, 0.09, 0.03]
MODEL = BlendShapeEvaluator(0.01 * RNG.normal(size=(SHAPES, 3 * MARKERS)))
TRUTH = np.clip(0.5 + 0.7 * np.sin(TIMES[:, None] * RNG.uniform(1, 4, SHAPES)), 0, 1)
STILL = FACE + (TRUTH @ MODEL.offsets).reshape(FRAMES, MARKERS, 3)
TURNS = Rotation.from_euler("y", 8 * np.sin(TIMES)[:, None], degrees=True).as_matrix()
MOVING = Pose(TURNS, 0.02 * np.stack([np.sin(TIMES)] * 3, 1))
KNOWN = Regularisation(1e-6, 0.0, SolveOptions(), tuple("abcde"), size=0.1)


def begun(positions: np.ndarray, moving_head: bool = True) -> tuple[ObservedTake, SolveRound]:
    rows = TakeRows.of(MotionModel(FACE, MODEL, 3, moving_head))
    seen = visible(positions)
    over = np.eye(3) if moving_head else None
    take = ObservedTake(TIMES, positions, seen, rows, over, None, 0.0)
    pose = rigid_fit(FACE, positions)[0] if moving_head else Pose.identity(FRAMES)
    space = fit_map(FACE, FACE, MapOptions())
    nothing = np.zeros(take.occluded.shape)
    return take, SolveRound(0, pose, pose.to_head(positions), space, KNOWN, nothing)


def test_rounds_settle_at_weights_and_pose() -> None:
    take, state = begun(MOVING.to_take(STILL))
    moves = []
    while not state.settled(take) and state.number < 40:
        state = next_round(take, state)
        moves.append(state.moved)
    assert state.settled(take) and moves[-1] < 1e-3 * moves[0]
    assert state.iterate is not None
    np.testing.assert_allclose(state.iterate.weights, TRUTH, atol=2e-3)
    np.testing.assert_allclose(state.pose.rotations, MOVING.rotations, atol=1e-4)


def test_a_round_leaves_what_it_is_given() -> None:
    take, before = begun(MOVING.to_take(STILL))
    kept = before.here.copy(), before.occluded_residual.copy(), before.pose.rotations.copy()
    one, other = next_round(take, before), next_round(take, before)
    assert before.number == 0 and one.number == 1
    for array, was in zip(
        (before.here, before.occluded_residual, before.pose.rotations), kept, strict=True
    ):
        np.testing.assert_array_equal(array, was)
    assert one.iterate is not None and other.iterate is not None
    np.testing.assert_array_equal(one.iterate.weights, other.iterate.weights)


def test_a_known_pose_stays() -> None:
    take, state = begun(STILL, moving_head=False)
    after = next_round(take, next_round(take, state))
    assert after.pose is state.pose and after.here is state.here
    assert after.settled(take)


def test_markers_that_are_occluded_are_no_settled_take_at_first() -> None:
    """They are interpolated until the pose has settled, and the rig's prediction from then on."""
    positions = STILL.copy()
    positions[20:25, 3] = np.nan
    take, state = begun(positions, moving_head=False)
    numbers = []
    while not state.settled(take) and state.number < 40:
        state = next_round(take, state)
        numbers.append(state.number)
    assert state.settled(take) and numbers[-1] > 10
    expected = (STILL - FACE).reshape(FRAMES, -1)[20:25, 9:12]
    np.testing.assert_allclose(state.observed[20:25, 9:12], expected, atol=1e-4)


@pytest.mark.parametrize("size", [1.0, 50.0])
def test_it_has_settled_by_what_moves_on_the_character(size: float) -> None:
    """A performer in other units than the character settles in the same round."""
    positions = MOVING.to_take(STILL)
    take, state = begun(positions)
    space = fit_map(size * FACE, FACE, MapOptions())
    pose = Pose(state.pose.rotations, size * state.pose.translations)
    large = replace(take, markers=size * take.markers, linear=np.eye(3) / size)
    other = replace(state, here=size * state.here, pose=pose, space=space)
    for _ in range(3):
        state, other = next_round(take, state), next_round(large, other)
        assert other.moved == pytest.approx(state.moved, rel=1e-5)


def test_noise_is_measured_once_begun() -> None:
    take, state = begun(STILL, moving_head=False)
    found = measured(take, state)
    assert found.number == 1 and found.regularisation is state.regularisation
    np.testing.assert_allclose(found.observed, (STILL - FACE).reshape(FRAMES, -1), atol=1e-12)
