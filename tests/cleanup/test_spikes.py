import numpy as np
import pytest

from usdface.cleanup.spikes import find_spikes

RATE, SIZE = 60.0, 0.06
TIME = np.arange(300)[:, None, None] / RATE
TOLD = 0.005 * np.sin(2 * TIME + np.arange(6)[:, None]) * np.ones(3)
# The others do not tell all: the error is slow, and as large as a spike.
STILL = TOLD + 0.004 * np.cos(3 * TIME + np.arange(6)[:, None])
ALL = np.ones((300, 6), dtype=bool)


def test_slow_errors_are_no_spikes() -> None:
    assert not find_spikes(STILL, TOLD, ALL, size=SIZE, rate=RATE).any()


@pytest.mark.parametrize("noise", [0.0, 3e-4])
@pytest.mark.parametrize("length", [1, 2, 5, 12])
def test_a_jump_away_and_back_is_a_spike(length: int, noise: float) -> None:
    still = STILL + noise * np.random.default_rng(1).normal(size=STILL.shape)
    truth = ~ALL
    truth[100 : 100 + length, 2] = True
    still[truth] += [0.0, 0.008, 0.0]
    np.testing.assert_array_equal(find_spikes(still, TOLD, ALL, size=SIZE, rate=RATE), truth)


def test_a_spike_may_begin_at_a_gap_or_end_with_the_take() -> None:
    seen, truth = ALL.copy(), ~ALL
    seen[90:100, 1] = False
    truth[100:103, 1] = truth[298:, 4] = True
    still = STILL + 0.02 * truth[..., None]
    np.testing.assert_array_equal(find_spikes(still, TOLD, seen, size=SIZE, rate=RATE), truth)


def test_a_jump_of_the_prediction_alone_is_none() -> None:
    named = TOLD.copy()
    named[100:103] += 0.02
    assert not find_spikes(STILL, named, ALL, size=SIZE, rate=RATE).any()


def test_a_marker_that_sits_elsewhere_for_long_is_one() -> None:
    truth = ~ALL
    truth[100:200, 3] = True
    still = STILL + 0.03 * truth[..., None]
    np.testing.assert_array_equal(find_spikes(still, TOLD, ALL, size=SIZE, rate=RATE), truth)


def test_a_slow_error_is_none_in_a_take_that_is_shorter_than_a_spike_may_be() -> None:
    """A marker starts elsewhere, in a tenth of a second at 1000 Hz."""
    error = np.r_[0.0, np.linspace(0.014, 0.008, 99)]
    still = np.zeros((100, 6, 3))
    still[:, 3, 1] = error
    found = find_spikes(still, 0.0 * still, ALL[:100], size=SIZE, rate=1000.0)
    assert not found[1:].any()


def test_a_marker_that_is_off_for_most_of_the_take_is_none() -> None:
    """It swings twice a second as no other does, and jumps once at the start."""
    still = TOLD.copy()
    still[:, 2, 1] += 0.01 * np.sin(2 * np.pi * 2.0 * TIME[:, 0, 0])
    still[0, 2, 1] += 0.02
    found = find_spikes(still, TOLD, ALL, size=SIZE, rate=RATE)
    assert not found[1:].any()
