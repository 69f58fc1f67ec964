import numpy as np
import pytest

from usdface.options import PERFORMER_GAIN_RANGE, PERFORMER_GAIN_SPREAD
from usdface.retarget.gain_posterior import gain_posterior


def test_a_small_movement_that_is_no_extreme_says_nothing() -> None:
    gains, spreads = gain_posterior(np.array([0.0, 0.2, 0.5]), np.full(3, 0.02), 0.0)
    assert gains == pytest.approx(1.0)
    assert spreads == pytest.approx(PERFORMER_GAIN_SPREAD, abs=0.01)


def test_what_goes_beyond_the_character_raises_the_gain_even_without_extremes() -> None:
    gains, spreads = gain_posterior(np.array([1.1, 1.25]), np.full(2, 0.01), 0.0)
    assert gains == pytest.approx([1.1, 1.25], abs=0.03)
    assert (spreads < 0.7 * PERFORMER_GAIN_SPREAD).all()


def test_an_extreme_is_the_gain() -> None:
    peaks = np.linspace(0.8, 1.25, 10)
    gains, spreads = gain_posterior(peaks, np.full(10, 0.01), 0.8)
    assert gains == pytest.approx(peaks, abs=0.06)
    assert (np.diff(gains) > 0).all()
    assert spreads[4] < 0.4 * PERFORMER_GAIN_SPREAD


def test_a_movement_far_from_its_extreme_leaves_the_prior() -> None:
    gains, spreads = gain_posterior(np.array([0.05, 0.3]), np.full(2, 0.02), 0.8)
    assert gains == pytest.approx(1.0, abs=0.02)
    assert spreads == pytest.approx(PERFORMER_GAIN_SPREAD, abs=0.02)


def test_the_less_sure_the_peak_the_nearer_to_one() -> None:
    gains, spreads = gain_posterior(np.full(4, 1.3), np.array([0.01, 0.1, 0.3, 3.0]), 0.8)
    assert (np.diff(gains) < 0).all() and gains[-1] == pytest.approx(1.0, abs=0.03)
    assert (np.diff(spreads) > 0).all()


@pytest.mark.parametrize("reached", [0.0, 0.8])
def test_gains_stay_in_their_range_whatever_the_take_does(reached: float) -> None:
    gains, spreads = gain_posterior(np.array([2.0, 40.0]), np.array([1e-6, 1e-9]), reached)
    assert (gains >= PERFORMER_GAIN_RANGE[0]).all() and (gains <= PERFORMER_GAIN_RANGE[1]).all()
    assert gains[1] == pytest.approx(PERFORMER_GAIN_RANGE[1]) and np.isfinite(spreads).all()


def test_a_performer_as_large_as_the_character_is_known_by_all_extremes_together() -> None:
    peaks = 1.0 + 0.05 * np.random.default_rng(1).normal(size=40)
    peaks[0] = 0.7  # badly seen
    deviations = np.full(40, 0.02)
    deviations[0] = 0.3
    together, _ = gain_posterior(peaks, deviations, 0.8)
    alone = [gain_posterior(peaks[[k]], deviations[[k]], 0.8)[0][0] for k in range(40)]
    assert np.abs(together - 1.0).max() < 0.02 < 0.08 < np.abs(np.array(alone) - 1.0).max()
    assert abs(together[0] - 1.0) < 0.1 * abs(alone[0] - 1.0)


def test_the_extremes_of_a_performer_who_differs_stay() -> None:
    peaks = np.random.default_rng(2).uniform(0.75, 1.3, 40)
    gains, _ = gain_posterior(peaks, np.full(40, 0.02), 0.8)
    assert np.corrcoef(gains, peaks)[0, 1] > 0.99
    assert np.std(gains) > 0.75 * np.std(peaks)
