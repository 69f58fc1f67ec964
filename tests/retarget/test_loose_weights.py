"""Weights beyond 0 and 1, and their peaks."""

import numpy as np

from usdface.options import SolveOptions
from usdface.retarget.loose_weights import held_peaks, loose_weights
from usdface.retarget.solver.regularisation import Regularisation

RNG = np.random.default_rng(0)
REST = RNG.normal(size=(20, 3))
OFFSETS = 0.1 * RNG.normal(size=(4, 20, 3))
TIMES = np.arange(60) / 30


def test_weights_beyond_1_come_back_under_a_moving_head() -> None:
    truth = np.abs(np.sin(TIMES[:, None] * [1.0, 2.0, 3.0, 5.0])) * [0.5, 1.0, 1.4, 1.8]
    turn = 1e-3 * np.sin(TIMES)[:, None, None] * np.cross([0.0, 1.0, 0.0], REST)
    moved = np.tensordot(truth, OFFSETS, 1) + turn + 0.01 * TIMES[:, None, None]
    exact = Regularisation(0.0, 0.0, SolveOptions())  # each frame for itself
    found, deviations = loose_weights(
        moved, REST, OFFSETS, TIMES, exact, moving_head=True, within=(0.0, 2.0)
    )
    np.testing.assert_allclose(found, truth, atol=1e-6)
    assert (deviations < 1e-3).all()


def test_a_peak_counts_if_it_is_held() -> None:
    weights = np.zeros((60, 2))
    weights[20, 0] = weights[20:23, 1] = 1.5
    np.testing.assert_array_equal(held_peaks(weights, TIMES), [0.0, 1.5])
