"""Blinks that a recorder names: pulses of its measure, and those that the markers show already."""

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.closure.eye_closing import EyeClosing
from usdface.closure.recorded_blinks import recorded_blinks, unseen_blinks

RATES = (24.0, 60.0)
STARTS = (1.0, 3.0)


def recorded(rate: float, height: float, length: float = 0.3) -> tuple[FloatArray, FloatArray]:
    """Return times (F,) and a measure (F,) with two pulses above a slow lowering of the lids."""
    times = np.arange(0.0, 6.0, 1.0 / rate)
    blink = 0.05 + 0.1 * np.sin(np.pi * times / 6.0)
    for start in STARTS:
        since = (times - start) / length
        blink += height * np.clip(np.minimum(3.0 * since, 1.5 * (1.0 - since)), 0.0, None)
    return times, blink


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("height", [0.25, 0.8])
def test_pulses_are_blinks_of_both_eyes(rate: float, height: float) -> None:
    times, blink = recorded(rate, height)
    found = recorded_blinks(times, blink)
    assert [each.eyes for each in found] == [(0, 1)] * len(STARTS)
    for each, start in zip(found, STARTS, strict=True):
        assert abs(each.closed - (start + 0.1)) < 0.05
        assert each.start < each.closed <= each.opened < each.end


@pytest.mark.parametrize("rates", [(24.0, 120.0), (120.0, 24.0)])
def test_blinks_are_found_where_the_rate_changes(rates: tuple[float, float]) -> None:
    times = np.concatenate([np.arange(0, 2, 1 / rates[0]), np.arange(2, 6, 1 / rates[1])])
    fine, curve = recorded(1000.0, 0.5)
    found = recorded_blinks(times, np.interp(times, fine, curve))
    assert len(found) == len(STARTS)
    for each, start in zip(found, STARTS, strict=True):
        assert abs(each.closed - (start + 0.1)) < 0.06
        assert ((each.closed <= times + 1e-9) & (times <= each.opened + 1e-9)).any()


def test_a_shallow_blink_beside_deep_ones_is_one() -> None:
    times, blink = recorded(60.0, 0.8)
    since = (times - 5.0) / 0.3
    shallow = 0.2 * np.clip(np.minimum(3.0 * since, 1.5 * (1.0 - since)), 0.0, None)
    assert len(recorded_blinks(times, blink + shallow)) == 3


def test_lower_pulses_than_the_least_intensity_are_none() -> None:
    assert recorded_blinks(*recorded(60.0, 0.06)) == []


def test_slow_lids_are_no_blinks() -> None:
    times = np.arange(0.0, 6.0, 1.0 / 60.0)
    lowered = 0.25 - 0.25 * np.cos(np.pi * np.clip((times - 2.0) / 0.6, 0.0, 2.0))
    assert lowered.max() == pytest.approx(0.5)
    assert recorded_blinks(times, lowered) == []


def test_frames_without_a_face_are_bridged() -> None:
    times, blink = recorded(60.0, 0.5)
    blink[100:140] = np.nan
    assert len(recorded_blinks(times, blink)) == 2
    assert recorded_blinks(times, np.full(len(times), np.nan)) == []


def test_a_take_of_two_frames_has_none() -> None:
    assert recorded_blinks(np.array([0.0, 0.1]), np.array([0.0, 1.0])) == []


def test_those_that_the_markers_show_are_left_out() -> None:
    first, second = (EyeClosing("blink", (0, 1), t, t + 0.1, t + 0.2, t + 0.3, 1.0) for t in (1, 3))
    shown = EyeClosing("held", (0,), 3.2, 3.3, 4.0, 4.2, 1.0)
    assert unseen_blinks([first, second], [shown]) == [first]
    assert unseen_blinks([first, second], []) == [first, second]
