"""Blinks and closed eyes, by the course of curves that are made of known ones."""

from typing import Any

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.closure.closings import _within, find_closings
from usdface.closure.eye_closing import EyeClosing, closing_course
from usdface.closure.solved_lids import SolvedLids

RATES = (24.0, 30.0, 60.0, 120.0)
BLINKS = (1.0, 2.3, 3.1, 5.0)


def closings_in(times: FloatArray, closing: FloatArray, **curves: Any) -> list[EyeClosing]:
    return find_closings(times, closing, **curves)[0]


def blink(times: FloatArray, start: float, height: float = 1.0) -> FloatArray:
    """80 ms down, 20 ms closed, 160 ms up."""
    rise = np.clip((times - start) / 0.08, 0, 1)
    fall = np.clip((start + 0.26 - times) / 0.16, 0, 1)
    return height * (0.5 - 0.5 * np.cos(np.pi * np.minimum(rise, fall)))


def swell(times: FloatArray, start: float, length: float, height: float) -> FloatArray:
    share = np.clip((times - start) / length, 0, 1)
    return height * (0.5 - 0.5 * np.cos(2 * np.pi * share))


def world(rate: float = 60.0, scale: float = 1.0, noise: float = 0.0) -> tuple[FloatArray, ...]:
    times = np.arange(0, 8, 1 / rate)
    eye = sum(blink(times, start) for start in BLINKS)
    both = scale * np.stack([eye, eye], axis=1)
    both += noise * np.random.default_rng(0).standard_normal(both.shape)
    return times, both


def blinks(closings: list[EyeClosing]) -> list[EyeClosing]:
    return [each for each in closings if each.kind == "blink"]


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("scale", [0.4, 1.0, 2.0])
def test_blinks_are_found_whatever_the_rate_and_the_reach_of_the_markers(
    rate: float, scale: float
) -> None:
    times, eyes = world(rate, scale)
    found = closings_in(times, eyes)
    assert [each.kind for each in found] == ["blink"] * len(BLINKS)
    for each, start in zip(found, BLINKS, strict=True):
        assert each.eyes == (0, 1)
        assert abs(each.closed - (start + 0.08)) < 0.04
        assert 0.05 <= each.closed - each.start <= 0.15
        assert each.end - each.opened > each.closed - each.start


MIXED = [(24, 120), (120, 24), (30, 30, 24), (24, 24, 24, 24, 120), (60, 5, 60)]


def uneven(rates: tuple[float, ...]) -> FloatArray:
    """Return times over 8 s whose rate changes, each for as long."""
    cuts = np.linspace(0, 8, len(rates) + 1)
    parts = [np.arange(a, b - 1e-6, 1 / r) for a, b, r in zip(cuts, cuts[1:], rates, strict=False)]
    return np.concatenate(parts)


@pytest.mark.parametrize("rates", MIXED[:-1])
def test_blinks_are_found_where_the_rate_changes(rates: tuple[float, ...]) -> None:
    times = uneven(rates)
    eye = sum(blink(times, start) for start in BLINKS)
    eyes = np.stack([eye, eye], axis=1)
    found = closings_in(times, eyes, gone=0.8 * eyes, by_itself=eyes, solved=SolvedLids(eyes, eyes))
    assert [each.kind for each in found] == ["blink"] * len(BLINKS)
    for each, start in zip(found, BLINKS, strict=True):
        assert each.eyes == (0, 1)
        assert abs(each.closed - (start + 0.08)) < 0.05
    # Each is shut in a frame of the take.
    course = closing_course(times, found)
    assert all(course[np.abs(times - start - 0.09) < 0.06].max() == 1.0 for start in BLINKS)


@pytest.mark.parametrize("rates", MIXED)
@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_noise_where_the_rate_changes_has_no_blinks(rates: tuple[float, ...], noise: float) -> None:
    times = uneven(rates)
    for seed in range(5):
        eyes = noise * np.random.default_rng(seed).standard_normal((len(times), 2))
        assert not closings_in(times, eyes)


@pytest.mark.parametrize("rates", MIXED[:2])
def test_an_eye_is_held_closed_where_the_rate_changes(rates: tuple[float, ...]) -> None:
    times = uneven(rates)
    rise = np.clip(np.minimum((times - 3.5) / 0.2, (4.7 - times) / 0.3), 0, 1)
    eye = blink(times, 1.0) + blink(times, 6.5) + rise**2 * (3 - 2 * rise)
    (held,) = [
        each for each in closings_in(times, np.stack([eye, eye], axis=1)) if each.kind == "held"
    ][:1]
    assert held.lids is not None and held.lids.shape == times.shape
    course = closing_course(times, [held])[:, held.eyes[0]]
    assert course[(times > 3.75) & (times < 4.3)].min() == 1.0
    assert not course[(times < 3.2) | (times > 5.0)].any()


@pytest.mark.parametrize("rates", MIXED[:2])
def test_pulses_that_leave_eyes_open_are_named_by_frames_of_the_take(
    rates: tuple[float, ...],
) -> None:
    times = uneven(rates)
    eye = sum(blink(times, start) for start in BLINKS)
    eyes = np.stack([eye, eye], axis=1)
    closings, left_open = find_closings(times, eyes, gone=0.1 * eyes)
    assert not closings
    np.testing.assert_allclose(times[left_open], np.add(BLINKS, 0.09), atol=0.04)


def test_blinks_are_found_in_noise() -> None:
    times, eyes = world(noise=0.05)
    assert len(closings_in(times, eyes)) == len(BLINKS)


@pytest.mark.parametrize("frames", range(6))
def test_a_take_of_few_frames_has_no_blinks(frames: int) -> None:
    assert not closings_in(np.arange(frames) / 30, np.zeros((frames, 2)))


@pytest.mark.parametrize("unseen", [0, 1])
def test_an_eye_that_is_not_seen_does_not_speak_for_lids_that_stay_open(unseen: int) -> None:
    times, eyes = world()
    eyes[:, unseen] = np.nan
    assert len(closings_in(times, eyes, gone=0.8 * eyes)) == len(BLINKS)
    closings, left_open = find_closings(times, eyes, gone=0.1 * eyes)
    assert not closings
    np.testing.assert_allclose(times[left_open], np.add(BLINKS, 0.09), atol=0.04)


def test_noise_alone_has_no_blinks() -> None:
    times, eyes = world(scale=0.0, noise=0.2)
    assert not closings_in(times, eyes)


@pytest.mark.parametrize("length", [0.5, 0.8, 1.5, 3.0])
def test_a_squint_is_no_blink(length: float) -> None:
    times, eyes = world()
    squint = swell(times, 6.0, length, 0.7)[:, None]
    found = closings_in(times, eyes + squint)
    assert [round(each.closed, 1) for each in found] == [1.1, 2.4, 3.2, 5.1]


def test_a_small_pulse_among_blinks_is_none() -> None:
    times, eyes = world()
    found = closings_in(times, eyes + blink(times, 6.5, 0.25)[:, None])
    assert len(found) == len(BLINKS)


def test_slow_drift_and_a_held_squint_change_no_blink() -> None:
    times, eyes = world()
    drift = 0.3 * np.sin(times)[:, None] + swell(times, 0.5, 6.0, 0.4)[:, None]
    found = blinks(closings_in(times, eyes + drift))
    assert [round(each.closed, 1) for each in found] == [1.1, 2.4, 3.2, 5.1]


def test_an_eye_that_stays_shut_is_held() -> None:
    times, eyes = world()
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)
    found = closings_in(times, eyes + shut[:, None] * [1.0, 0.0])
    held = [each for each in found if each.kind == "held"]
    assert [each.eyes for each in held] == [(0,)]
    assert held[0].closed < 6.25 and held[0].opened > 7.25
    assert len(blinks(found)) == len(BLINKS)


def test_an_eye_alone_must_be_shut_wholly() -> None:
    times, eyes = world()
    narrowed = 0.8 * np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)
    for other, held in ((1.0, 2), (0.5, 0)):
        found = closings_in(times, eyes + narrowed[:, None] * [1.0, other])
        assert [each.kind for each in found].count("held") == held


def test_winks_of_one_eye_do_not_tell_when_the_other_is_closed() -> None:
    """The lids of both are half closed at the end, where the markers show more."""
    times = np.arange(0, 12, 1 / 60)
    both = blink(times, 1.0) + blink(times, 2.0)
    winks = sum(
        np.clip(np.minimum((times - start) / 0.08, (start + 0.34 - times) / 0.16), 0, 1)
        for start in (3.0, 4.2, 5.4, 6.6, 7.8)
    )
    seen = np.stack([both + winks, both], axis=1)
    narrowed = np.clip(np.minimum(times - 9.0, 11.0 - times) / 0.2, 0, 1)[:, None]
    for depth, held in ((0.5, []), (1.0, [(0,), (1,)])):
        lids = seen + depth * narrowed
        found = closings_in(times, seen + narrowed, gone=lids, solved=SolvedLids(lids, lids))
        assert [each.eyes for each in blinks(found)] == [(0, 1)] * 2 + [(0,)] * 5
        assert sorted(each.eyes for each in found if each.kind == "held") == held


def test_of_two_eyes_narrowed_alike_none_is_shut_alone() -> None:
    """One of them shows its blinks half as far as the other."""
    times, eyes = world()
    narrowed = 0.5 * np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)
    found = closings_in(times, eyes * [0.5, 1.0] + narrowed[:, None] * [1.0, 1.1])
    assert [each.kind for each in found] == ["blink"] * len(BLINKS)


def test_raised_brows_over_which_an_eye_blinks_close_none() -> None:
    """They pull the skin of the lids up, so that the blinks' own level is below rest."""
    times, eyes = world()
    raised = np.clip(np.minimum(times - 0.2, 7.5 - times) / 0.3, 0, 1)
    found = closings_in(times, eyes - 1.6 * raised[:, None] * [1.0, 0.1])
    assert [(each.kind, each.eyes) for each in found] == [("blink", (0, 1))] * len(BLINKS)


def test_a_fast_pulse_of_the_skin_around_a_lid_is_no_blink() -> None:
    times, eyes = world()
    brow = blink(times, 6.0)[:, None] * [1.0, 1.0]
    for share, count in ((0.2, len(BLINKS)), (0.9, len(BLINKS) + 1)):
        assert len(closings_in(times, eyes + brow, by_itself=eyes + share * brow)) == count


def test_pulses_that_hardly_move_the_markers_are_none() -> None:
    times, eyes = world(scale=0.5)
    assert len(closings_in(times, eyes, least=np.array([0.4, 0.4]))) == len(BLINKS)
    assert not closings_in(times, eyes, least=np.array([0.6, 0.6]))
    one_sees = closings_in(times, eyes, least=np.array([0.4, 0.6]))
    assert [each.eyes for each in one_sees] == [(0, 1)] * len(BLINKS)


def test_two_eyes_stand_out_of_noise_where_one_does_not() -> None:
    times, eyes = world(noise=0.4)
    assert len(closings_in(times, eyes)) == len(BLINKS)
    eyes[:, 1] = np.nan
    assert len(closings_in(times, eyes)) < len(BLINKS)


def test_a_lid_that_only_comes_back_to_rest_closes_no_eye() -> None:
    """Wide open but for a moment, it moves as fast and as far as in a blink."""
    times, eyes = world()
    wide = np.clip(np.minimum(times - 5.6, 7.5 - times) / 0.2, 0, 1)
    pulse = blink(times, 6.5)
    moved = eyes + (pulse - wide)[:, None]
    assert len(closings_in(times, moved)) == len(BLINKS) + 1
    assert len(closings_in(times, moved, gone=moved)) == len(BLINKS)


@pytest.mark.parametrize("reach", [0.4, 1.0])
def test_a_pulse_that_closes_less_than_half_of_the_blinks_is_none(reach: float) -> None:
    times, eyes = world()
    squint = blink(times, 6.5)[:, None] * [1.0, 1.0]
    for share, count in ((0.4, len(BLINKS)), (0.7, len(BLINKS) + 1)):
        lids = reach * (eyes + share * squint)
        assert len(closings_in(times, eyes + squint, gone=lids)) == count


def test_a_pulse_as_large_as_the_blinks_is_one_though_the_lids_seem_open() -> None:
    """Markers at wrong places: the estimate of what is gone drifts with the jaw."""
    times, eyes = world()
    drift = swell(times, 5.6, 1.9, -0.3)[:, None]
    pulse = blink(times, 6.4)[:, None]
    for share, count in ((0.9, len(BLINKS) + 1), (0.6, len(BLINKS))):
        lids = 0.55 * eyes + drift + 0.55 * share * pulse
        assert len(closings_in(times, eyes + pulse, gone=lids)) == count


def test_pulses_that_are_small_for_these_lids_make_no_blinks_of_each_other() -> None:
    times, eyes = world()
    drift = swell(times, 5.6, 1.9, -0.15)[:, None]
    pulse = blink(times, 6.4)[:, None]
    for narrowed, count in ((0.5, len(BLINKS) + 1), (1.6, len(BLINKS))):
        slow = swell(times, 3.5, 1.3, narrowed)[:, None]
        lids = 0.3 * (eyes + pulse) + drift + slow
        found = blinks(closings_in(times, eyes + pulse, gone=lids))
        assert len(found) == count


def test_quick_squints_of_lids_that_move_more_otherwise_are_no_blinks() -> None:
    times, eyes = world()
    narrowed = 0.8 * np.clip(np.minimum(times - 5.6, 7.5 - times) / 0.5, 0, 1)[:, None]
    for share, count in ((0.15, 0), (0.6, len(BLINKS))):
        lids = share * eyes + narrowed
        assert len(blinks(closings_in(times, eyes + narrowed, gone=lids))) == count


def test_an_eye_is_not_held_closed_where_its_lids_are_apart() -> None:
    times, eyes = world()
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)[:, None]
    kinds = [each.kind for each in closings_in(times, eyes + shut, gone=eyes + 0.4 * shut)]
    assert kinds == ["blink"] * len(BLINKS)


def test_a_squint_that_is_solved_half_open_closes_no_eye_though_the_markers_say_so() -> None:
    times, eyes = world()
    quick = blink(times, 6.0)[:, None]
    long = np.clip(np.minimum(times - 6.6, 7.8 - times) / 0.2, 0, 1)[:, None]
    seen = eyes + quick + long
    for share, kinds in ((1.0, ["blink"] * 5 + ["held"] * 2), (0.5, ["blink"] * 4)):
        solved = SolvedLids(eyes + share * (quick + long), eyes + share * (quick + long))
        found = closings_in(times, seen, gone=0.8 * seen, solved=solved)
        assert [each.kind for each in found] == kinds


def test_pulses_that_are_solved_as_squints_do_not_tell_when_an_eye_is_held_closed() -> None:
    times, eyes = world()
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)[:, None]
    seen = eyes + shut
    for share, held in ((1.0, 2), (0.1, 0)):
        found = closings_in(times, seen, gone=seen, solved=SolvedLids(seen, share * seen))
        assert len(found) - len(blinks(found)) == held


def test_an_eye_that_closes_harder_than_it_blinks_is_closed_while_it_does() -> None:
    """Squeezed shut, it opens while its markers are still beyond those of a blink."""
    times, eyes = world()
    squeezed = 2.5 * np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.5, 0, 1)
    found = closings_in(times, eyes + squeezed[:, None] * [1.0, 0.0])
    (held,) = (each for each in found if each.kind == "held")
    assert held.closed == pytest.approx(6.4, abs=0.04)
    assert held.opened == pytest.approx(7.1, abs=0.04)


def test_a_wink_is_of_one_eye_and_a_fast_pulse_of_both() -> None:
    times, eyes = world()
    wink = np.clip(np.minimum((times - 6.0) / 0.08, (6.4 - times) / 0.16), 0, 1)
    one = np.array([1.0, 0.0])
    slow = closings_in(times, eyes + wink[:, None] * one)[-1]
    assert slow.eyes == (0,) and not slow.guessed
    fast = blinks(closings_in(times, eyes + blink(times, 6.0)[:, None] * one))[-1]
    assert fast.eyes == (0, 1) and fast.guessed


def test_an_eye_without_markers_blinks_with_the_other() -> None:
    times, eyes = world()
    eyes[:, 1] = np.nan
    found = closings_in(times, eyes)
    assert [each.eyes for each in found] == [(0, 1)] * len(BLINKS)
    assert all(each.guessed for each in found)


def test_left_and_right_are_alike() -> None:
    times, eyes = world(noise=0.03)
    eyes[:, 0] *= 0.7
    mirrored = closings_in(times, eyes[:, ::-1])
    for a, b in zip(closings_in(times, eyes), mirrored, strict=True):
        assert a.closed == b.closed and a.eyes == tuple(sorted(1 - eye for eye in b.eyes))


def test_short_takes_and_takes_without_eyes_have_none() -> None:
    assert not closings_in(np.zeros(1), np.zeros((1, 2)))
    assert not closings_in(np.arange(90) / 30, np.full((90, 2), np.nan))


def test_an_eye_is_not_held_closed_where_its_brow_lowers_the_lid() -> None:
    times, eyes = world()
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)
    closing = eyes + shut[:, None]
    kinds = [each.kind for each in closings_in(times, closing, by_itself=closing)]
    assert "held" in kinds
    assert kinds == [
        each.kind for each in closings_in(times, closing, by_itself=np.full_like(closing, np.nan))
    ]
    lowered = closings_in(times, closing, by_itself=eyes + 0.3 * shut[:, None])
    assert [each.kind for each in lowered] == ["blink"] * len(BLINKS)


@pytest.mark.parametrize(("depth", "held"), [(1.0, 2), (2.2, 2), (2.5, 0)])
def test_a_brow_that_is_lowered_closes_no_eye_further_than_a_blink(depth: float, held: int) -> None:
    """Of one eye, and no other meanwhile."""
    times, eyes = world()
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)[:, None]
    lids = eyes + shut * [depth, 1.0]
    kinds = [each.kind for each in closings_in(times, eyes + shut, gone=lids)]
    assert kinds.count("held") == held


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0])
def test_the_level_of_a_closed_eye_is_that_of_a_blink_before_it_is_smoothed(rate: float) -> None:
    """In frames 33 ms apart smoothing takes a fifth of a blink, and nothing of an eye held shut."""
    times, eyes = world(rate)
    shut = np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)[:, None]
    for depth, held in ((0.7, 0), (0.9, 2)):
        found = closings_in(times, eyes + depth * shut)
        assert [each.kind for each in found].count("held") == held


def test_an_eye_that_is_not_solved_must_be_shut_further_the_less_sure_that_is() -> None:
    times, eyes = world()
    shut = 0.86 * np.clip(np.minimum(times - 6.0, 7.5 - times) / 0.2, 0, 1)[:, None]
    seen = eyes + shut
    unknown = np.full_like(seen, np.nan)
    for curve, unsure, held in ((seen, 0.6, 2), (unknown, 0.6, 0), (unknown, 0.1, 2)):
        found = closings_in(
            times, seen, gone=seen, deviation=np.full(2, unsure), solved=SolvedLids(curve, curve)
        )
        assert [each.kind for each in found].count("held") == held


def test_a_closed_eye_is_the_top_of_a_blink_of_that_eye_alone() -> None:
    wink = EyeClosing("blink", (0,), 1.0, 1.1, 1.2, 1.4, 1.0)
    both = EyeClosing("blink", (0, 1), 1.0, 1.1, 1.2, 1.4, 1.0)
    for eye, blinks_of, within in ((0, wink, True), (1, wink, False), (1, both, True)):
        held = EyeClosing("held", (eye,), 0.9, 1.05, 1.3, 1.5, 1.0)
        assert _within(held, [blinks_of]) is within
