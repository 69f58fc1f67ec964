"""Pulses of a lid on any level, and the times at which they pass a share of their height."""

import numpy as np
import pytest

from usdface.closure.lid_pulses import crossing_time, lid_pulses

STEP = 1 / 60
TIMES = np.arange(0, 6, STEP)


def bump(start: float, length: float) -> np.ndarray:
    share = np.clip((TIMES - start) / length, 0, 1)
    return 0.5 - 0.5 * np.cos(2 * np.pi * share)


@pytest.mark.parametrize("level", [0.0, 0.4, -0.3])
def test_a_short_pulse_is_left_whatever_the_level(level: float) -> None:
    _, pulses, noise = lid_pulses(level + bump(2.0, 0.3), STEP)
    at = int(pulses.argmax())
    assert abs(TIMES[at] - 2.15) <= STEP and 0.9 < pulses[at] <= 1.0
    assert np.abs(pulses[(TIMES < 1.8) | (TIMES > 2.6)]).max() < 1e-6
    assert noise < 1e-3


def test_what_lasts_longer_than_a_blink_is_no_pulse() -> None:
    _, pulses, _ = lid_pulses(bump(1.0, 3.0), STEP)
    assert pulses.max() < 0.15


def test_noise_is_measured_and_stays_below_its_limit() -> None:
    noisy = 0.1 * np.random.default_rng(0).standard_normal(len(TIMES))
    _, pulses, noise = lid_pulses(noisy, STEP)
    assert 0.05 < pulses.max() < noise < 0.5


def test_a_level_is_passed_between_two_frames() -> None:
    times, share = np.arange(5.0), np.array([0.0, 0.4, 1.0, 0.5, 0.0])
    assert crossing_time(times, share, 2, -1, 0.7) == pytest.approx(1.5)
    assert crossing_time(times, share, 2, 1, 0.25) == pytest.approx(3.5)
    # Never so low: the end of the take.
    assert crossing_time(times, share, 2, 1, -1.0) == 4.0
