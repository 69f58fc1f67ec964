from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.timing import ASSUMED_RATE, nominal_rate, take_times

FILE = Path("take.csv")


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0, 120.0, 30000 / 1001])
@pytest.mark.parametrize("digits", [3, 5, 9])
def test_the_rate_survives_rounded_times_and_dropped_frames(rate, digits):
    frames = np.delete(np.arange(400), [7, 8, 9, 200])
    assert nominal_rate(np.round(frames / rate, digits)) == pytest.approx(rate, rel=1e-3)


def test_times_written_with_few_digits_are_those_of_the_grid():
    exact = np.arange(100) / 60
    times, rate, findings = take_times(FILE, 100, rate=60, seconds=np.round(exact + 5, 3))
    np.testing.assert_array_equal(times, exact)
    assert (rate, findings) == (60, [])


@pytest.mark.parametrize(("named", "own"), [(30.0, 120.0), (120.0, 30.0), (100.0, 120.0)])
def test_regular_times_count_where_the_file_names_another_rate(named, own):
    seconds = np.arange(60) / own
    times, rate, findings = take_times(FILE, 60, rate=named, seconds=seconds)
    np.testing.assert_allclose(times, seconds)
    assert (rate, codes(findings)) == (own, ["RATE_CONTRADICTED"])
    assert f"{own:g} Hz, not at {named:g}" in findings[0].message
    same, rate, findings = take_times(FILE, 60, rate=named, seconds=seconds, override=own)
    np.testing.assert_allclose(same, seconds)
    assert (rate, findings) == (own, [])
    stretched, rate, _ = take_times(FILE, 60, rate=named, seconds=seconds, override=named)
    np.testing.assert_allclose(stretched, np.arange(60) / named)
    assert rate == named


@pytest.mark.parametrize(("named", "own"), [(60.0, 60 / 1.001), (59.94, 60.0), (120.0, 119.88)])
@pytest.mark.parametrize("digits", [3, 9])
def test_rates_that_are_close_are_told_apart(named, own, digits):
    """As where a header rounds the rate: in a minute its frames are 3.6 away from their times."""
    seconds = np.round(np.arange(1000) / own, digits)
    times, rate, findings = take_times(FILE, 1000, rate=named, seconds=seconds)
    assert (rate, codes(findings)) == (pytest.approx(own, rel=1e-4), ["RATE_CONTRADICTED"])
    np.testing.assert_allclose(times * rate, np.arange(1000), atol=1e-6)
    short, rate, findings = take_times(FILE, 60, rate=named, seconds=seconds[:60])
    np.testing.assert_allclose(short * named, np.arange(60), atol=1e-6)
    assert (rate, findings) == (named, [])


def test_the_rounded_rate_of_film_is_the_exact_one():
    """Else a take is ahead of its sound by a frame after four minutes."""
    exact = 24 / 1.001
    seconds = np.round(np.arange(7000) / exact, 3)
    for given in ({}, {"seconds": seconds}, {"frames": np.arange(7000.0)}):
        times, rate, findings = take_times(FILE, 7000, rate=23.98, **given)
        assert (rate, findings) == (exact, [])
        np.testing.assert_allclose(times, np.arange(7000) / exact)
    assert take_times(FILE, 7000, rate=float(np.float32(23.98)))[1] == exact  # as C3D has it
    times, rate, _ = take_times(FILE, 7000, rate=30.0, override=23.98)
    assert rate == exact
    np.testing.assert_allclose(times, np.arange(7000) / exact)


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_times_in_milliseconds_are_told_by_the_rate_of_the_file(rate):
    times, found, findings = take_times(
        FILE, 60, rate=rate, seconds=np.round(1000.0 * np.arange(60) / rate, 1)
    )
    np.testing.assert_allclose(times, np.arange(60) / rate)
    assert (found, codes(findings)) == (rate, ["TIMES_IN_MILLISECONDS"])


def test_irregular_times_say_nothing_against_the_rate_of_the_file():
    seconds = np.cumsum(np.where(np.arange(60) % 2, 3, 1)) / 120
    _, rate, findings = take_times(FILE, 60, rate=120, seconds=seconds)
    assert (rate, codes(findings)) == (120, ["FRAMES_DROPPED"])


def test_times_off_the_grid_stay_as_they_are():
    seconds = np.array([0.0, 0.011, 0.025, 0.031])
    times, _, _ = take_times(FILE, 4, rate=100, seconds=seconds)
    np.testing.assert_allclose(times, seconds)


def test_dropped_frames_stay_gaps():
    times, rate, findings = take_times(FILE, 4, seconds=np.array([0.0, 0.1, 0.4, 0.5]))
    np.testing.assert_allclose(times, [0, 0.1, 0.4, 0.5])
    assert rate == 10
    assert codes(findings) == ["FRAMES_DROPPED"]
    assert findings[0].message.startswith("2 frames")


def test_frame_numbers_count_at_the_rate():
    times, _, findings = take_times(FILE, 3, frames=np.array([10.0, 11, 13]), override=50)
    np.testing.assert_allclose(times, [0, 0.02, 0.06])
    assert codes(findings) == ["FRAMES_DROPPED"]


def test_a_rate_nobody_names_is_announced():
    times, rate, findings = take_times(FILE, 3)
    np.testing.assert_allclose(times, np.arange(3) / ASSUMED_RATE)
    assert (rate, codes(findings)) == (ASSUMED_RATE, ["RATE_ASSUMED"])


def test_the_override_stretches_times():
    times, rate, findings = take_times(
        FILE, 3, rate=60, seconds=np.array([0, 1 / 60, 3 / 60]), override=30
    )
    np.testing.assert_allclose(times, [0, 1 / 30, 3 / 30])
    assert rate == 30
    assert codes(findings) == ["FRAMES_DROPPED"]


def test_one_frame_has_no_rate_of_its_own():
    times, rate, findings = take_times(FILE, 1, seconds=np.array([3.0]))
    assert (times.tolist(), rate, findings) == ([0.0], 0.0, [])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"count": 0}, "no frames"),
        ({"count": 2, "seconds": np.array([1.0, 1.0])}, "does not increase at frame 1"),
        ({"count": 2, "seconds": np.array([1.0, 1.0])}, "delete or sort the rows"),
        ({"count": 4, "seconds": np.array([0, 1.0, 0, 1])}, "file of each of the joined takes"),
        ({"count": 2, "seconds": np.array([0.0, np.nan])}, "frame 1 of the data has no time"),
        ({"count": 2, "seconds": np.array([-1e308, 1e308])}, "too far"),
        ({"count": 2, "frames": np.array([2.0, 1.0])}, "frame number does not increase"),
        ({"count": 2, "override": 0.0}, "rate of 0.0"),
        ({"count": 2, "override": float("nan")}, "rate of nan"),
    ],
)
def test_times_that_cannot_be(arguments, says):
    with pytest.raises(InputError, match=f"take.csv: .*{says}"):
        take_times(FILE, **arguments)


def test_frames_closer_than_a_microsecond_are_in_another_unit():
    with pytest.raises(InputError, match="another unit than seconds"):
        take_times(FILE, 3, seconds=np.array([0, 1e-9, 2e-9]))
