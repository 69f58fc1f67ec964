"""Even times of takes whose frame rate changes."""

import numpy as np
import pytest

from usdface.closure.even_times import even_times

MIXED = np.concatenate([np.arange(0, 4, 1 / 24), np.arange(4, 8, 1 / 120)])


@pytest.mark.parametrize("rate", [5.0, 24.0, 29.97, 60.0, 240.0, 1000.0])
def test_an_even_take_keeps_its_frames(rate: float) -> None:
    times = np.arange(0.0, 10.0, 1.0 / rate)
    values = np.random.default_rng(0).standard_normal((len(times), 2))
    for own in (times, np.round(times, 3), np.delete(times, len(times) // 2)):
        even = even_times(own)
        assert even.own and even.step == pytest.approx(1.0 / rate, rel=0.3)
        assert even.resampled(values) is values and even.of_frames(values) is values


@pytest.mark.parametrize("frames", range(3))
def test_takes_of_few_frames_are_even(frames: int) -> None:
    assert even_times(np.arange(frames) / 60).own


def test_the_slower_rate_counts() -> None:
    even = even_times(MIXED)
    assert not even.own and even.step == pytest.approx(1 / 24)
    np.testing.assert_allclose(np.diff(even.times), even.step)
    assert (even.times[0], even.times[-1]) == pytest.approx((0.0, MIXED[-1]), abs=even.step)


def test_a_gap_is_no_rate() -> None:
    """Ten seconds without a frame do not make the steps of a take longer."""
    times = np.concatenate([np.arange(0, 4, 1 / 60), np.arange(14, 18, 1 / 60)])
    even = even_times(times)
    assert not even.own and even.step == pytest.approx(1 / 60)


def test_a_take_of_gaps_keeps_its_frames() -> None:
    times = np.concatenate([np.arange(0, 4, 1 / 60), 1e7 + np.arange(0, 4, 1 / 60)])
    assert even_times(times).own


def test_lines_come_back_and_unmeasured_columns_stay() -> None:
    even = even_times(MIXED)
    line = np.stack([MIXED, np.full(len(MIXED), np.nan), np.full(len(MIXED), np.inf)], axis=1)
    there = even.resampled(line)
    np.testing.assert_allclose(there[:, 0], even.times)
    back = even.of_frames(there)
    inside = even.times[-1] >= MIXED
    np.testing.assert_allclose(back[inside, 0], MIXED[inside])
    assert np.isnan(back[:, 1]).all() and np.isinf(back[:, 2]).all()


def test_places_are_those_of_the_nearest_frames() -> None:
    even = even_times(MIXED)
    places = np.arange(len(even.times))
    away = np.abs(MIXED[even.frames(places)] - even.times)
    np.testing.assert_allclose(away, np.abs(MIXED - even.times[:, None]).min(axis=1))
