"""Blinks among the pulses of the lids, by their height and course."""

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.closure.blinks import blink_height, find_blinks

STARTS = (1.0, 2.5, 4.0)
RATES = (24.0, 120.0)


def pulses(rate: float, height: float = 0.8, length: float = 0.3) -> tuple[FloatArray, FloatArray]:
    """Return times (F,) and pulses (F,), highest a third after they begin."""
    times = np.arange(0.0, 6.0, 1.0 / rate)
    course = np.zeros(len(times))
    for start in STARTS:
        since = (times - start) / length
        course += height * np.clip(np.minimum(3.0 * since, 1.5 * (1.0 - since)), 0.0, None)
    return times, course


@pytest.mark.parametrize("rate", RATES)
def test_the_height_is_that_of_the_pulses(rate: float) -> None:
    _, course = pulses(rate)
    assert blink_height(course, 0.0, 1.0 / rate) == pytest.approx(0.8, rel=0.15)


def test_pulses_of_the_skin_have_no_height() -> None:
    _, course = pulses(60.0)
    assert np.isnan(blink_height(course, 0.9, 1.0 / 60.0))
    assert np.isnan(blink_height(0.0 * course, 0.0, 1.0 / 60.0))


@pytest.mark.parametrize("rate", RATES)
def test_they_are_closed_at_their_peaks(rate: float) -> None:
    times, course = pulses(rate)
    both = np.stack([course, course], axis=1)
    none = np.zeros(both.shape, dtype=bool)
    found, peaks = find_blinks(times, both, none, np.full(2, 0.8), np.zeros(2))
    assert len(found) == len(peaks) == len(STARTS)
    for blink, peak, start in zip(found, peaks, STARTS, strict=True):
        assert blink.eyes == (0, 1) and not blink.guessed
        assert abs(times[peak] - (start + 0.1)) < 1.5 / rate
        assert blink.start < blink.closed <= times[peak] <= blink.opened < blink.end


def test_a_slow_tail_does_not_hold_the_eye_shut() -> None:
    """It is half open again where the lids are: a tail of 0.4 s at a fifth delayed it by 0.07 s."""
    times = np.arange(0.0, 6.0, 1.0 / 120.0)
    course = np.zeros(len(times))
    for start in STARTS:
        since = times - start
        fast = np.minimum(since / 0.1, (0.25 - since) / 0.15)
        tail = np.where((since > 0.1) & (since < 0.6), 0.2 * (0.6 - since) / 0.5, 0.0)
        course += 0.8 * np.maximum(np.clip(fast, 0.0, None), tail)
    both = np.stack([course, course], axis=1)
    none = np.zeros(both.shape, dtype=bool)
    found, _ = find_blinks(times, both, none, np.full(2, 0.8), np.zeros(2))
    assert len(found) == len(STARTS)
    for blink, start in zip(found, STARTS, strict=True):
        assert (blink.opened + blink.end) / 2 - start == pytest.approx(0.175, abs=0.01)
        assert (blink.start + blink.closed) / 2 - start == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(("others", "found"), [(0.3, [0, 1]), (0.62, [0, 1, 2])])
def test_a_pulse_a_little_slower_than_slow_blinks_is_one_of_them(
    others: float, found: list[int]
) -> None:
    """Its second half takes 0.115 s, that of the others 0.05 or 0.103 s."""
    times = np.arange(0.0, 6.0, 1.0 / 120.0)
    course = np.zeros(len(times))
    for start, length in zip(STARTS, (others, others, 0.69), strict=True):
        since = (times - start) / length
        course += 0.8 * np.clip(np.minimum(3.0 * since, 1.5 * (1.0 - since)), 0.0, None)
    both = np.stack([course, course], axis=1)
    none = np.zeros(both.shape, dtype=bool)
    _, peaks = find_blinks(times, both, none, np.full(2, 0.8), np.zeros(2))
    assert [int(np.searchsorted(STARTS, times[peak])) - 1 for peak in peaks] == found


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0])
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5, 0.8])
def test_slow_blinks_are_found_whatever_the_frames(rate: float, phase: float) -> None:
    """The second half of their closing takes 0.1 s."""
    times = np.arange(0.0, 6.0, 1.0 / rate)
    course = np.zeros(len(times))
    for start in STARTS:
        since = (times - start - phase / rate) / 0.4
        course += 0.8 * np.cos(np.pi * np.clip(since - 0.5, -0.5, 0.5)) ** 2
    both = np.stack([course, course], axis=1)
    none = np.zeros(both.shape, dtype=bool)
    _, peaks = find_blinks(times, both, none, np.full(2, 0.8), np.zeros(2))
    assert len(peaks) == len(STARTS)


def test_of_two_eyes_that_show_no_blink_nothing_is_found() -> None:
    times, course = pulses(60.0)
    both = np.stack([course, course], axis=1)
    skin = np.zeros(both.shape, dtype=bool)
    found, peaks = find_blinks(times, both, skin, np.full(2, np.nan), np.zeros(2))
    assert not found and not len(peaks)
    found, peaks = find_blinks(times, both, ~skin, np.full(2, 0.8), np.zeros(2))
    assert not found and not len(peaks)
