"""Weights beyond 0 and 1, and their peaks."""

import numpy as np

from usdface.options import SolveOptions
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.wide_bounds import held_peaks, resting_weights, weights_in_wide_bounds

RNG = np.random.default_rng(0)
REST = RNG.normal(size=(20, 3))
OFFSETS = 0.1 * RNG.normal(size=(4, 20, 3))
TIMES = np.arange(60) / 30


def test_weights_beyond_1_come_back_under_a_moving_head() -> None:
    truth = np.abs(np.sin(TIMES[:, None] * [1.0, 2.0, 3.0, 5.0])) * [0.5, 1.0, 1.4, 1.8]
    turn = 1e-3 * np.sin(TIMES)[:, None, None] * np.cross([0.0, 1.0, 0.0], REST)
    moved = np.tensordot(truth, OFFSETS, 1) + turn + 0.01 * TIMES[:, None, None]
    exact = Regularisation(0.0, 0.0, SolveOptions())  # each frame for itself
    found, deviations = weights_in_wide_bounds(
        moved, MotionModel.linear(REST, OFFSETS, 3, True), TIMES, exact, within=(0.0, 2.0)
    )
    np.testing.assert_allclose(found, truth, atol=1e-6)
    assert (deviations < 1e-3).all()


def test_a_peak_counts_if_it_is_held() -> None:
    weights = np.zeros((60, 2))
    weights[20, 0] = weights[20:23, 1] = 1.5
    np.testing.assert_array_equal(held_peaks(weights, TIMES), [0.0, 1.5])


def test_a_shape_rests_where_it_comes_down_to() -> None:
    weights = np.abs(np.sin(np.arange(600)[:, None] * [0.11, 0.17])) - [0.0, 0.1]
    offsets = np.eye(2)
    np.testing.assert_allclose(resting_weights(weights, offsets), [0.0, -0.1], atol=0.1)
    # At the same weight in all frames, exactly there.
    weights[:, 1] = -0.07
    assert resting_weights(weights, offsets)[1] == -0.07


def test_motion_to_the_left_is_no_rest_on_the_right() -> None:
    """A third of the take goes left, which weights of the right below 0 explain in part."""
    weights = np.zeros((600, 2))
    weights[:200, 0] = weights[400:, 1] = 1.0
    weights[:200, 1] = weights[400:, 0] = -0.15
    offsets = np.array([[1.0, 0.0], [-0.9, 0.1]])
    assert np.quantile(weights, 0.05, axis=0).max() == -0.15
    np.testing.assert_array_equal(resting_weights(weights, offsets), 0.0)


def test_rest_does_not_depend_on_the_size_of_the_face() -> None:
    weights, offsets = RNG.normal(size=(200, 4)), OFFSETS.reshape(4, -1)
    np.testing.assert_array_equal(
        resting_weights(weights, offsets), resting_weights(weights, 1000 * offsets)
    )
