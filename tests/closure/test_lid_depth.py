"""Depth of pulses: deep ones are blinks, shallow ones and those of other shapes are not."""

from dataclasses import replace

import numpy as np
import pytest

from usdface.closure.eye_closing import EyeClosing
from usdface.closure.lid_depth import (
    as_deep_as_others,
    closed_as_solved,
    has_closed_level,
    lid_depth,
    pulses_that_close,
)

STEP = 1 / 60
TIMES = np.arange(0, 8, STEP)
STARTS = np.array([1.0, 2.3, 3.6, 5.0])
PEAKS = np.round((STARTS + 0.1) / STEP).astype(np.int64)
LOW = np.zeros(4)
BLINK = EyeClosing("blink", (0, 1), 0.0, 0.05, 0.1, 0.2, 1.0)


def pulses(heights: list[float]) -> np.ndarray:
    """Return a curve (F, 2) that is as high as asked around each peak for 0.2 s."""
    each = [
        height * np.sin(np.pi * np.clip((TIMES - start) / 0.2, 0, 1))
        for height, start in zip(heights, STARTS, strict=True)
    ]
    return np.repeat(np.sum(each, axis=0)[:, None], 2, axis=1)


def narrowed(depth: float) -> np.ndarray:
    """Return a curve (F, 2) of lids that are half closed from 6 s on."""
    return np.repeat(depth * np.clip((TIMES - 6.0) / 0.5, 0, 1)[:, None], 2, axis=1)


def test_depth_of_a_curve() -> None:
    depth = lid_depth(0.3 + pulses([1.0, 0.5, 1.0, 1.0]), STEP)
    np.testing.assert_allclose(depth.most[PEAKS][:, 0], [1.3, 0.8, 1.3, 1.3], atol=0.08)
    np.testing.assert_allclose(depth.swept[PEAKS][:, 0], [1.0, 0.5, 1.0, 1.0], atol=0.08)
    assert (depth.gone <= depth.most).all()


def test_an_eye_that_is_not_seen_is_infinitely_deep() -> None:
    curve = pulses([1.0, 1.0, 1.0, 1.0])
    curve[:, 1] = np.nan
    depth = lid_depth(curve, STEP)
    assert np.isinf(depth.gone[:, 1]).all() and np.isfinite(depth.gone[:, 0]).all()
    assert pulses_that_close(depth, PEAKS, [BLINK] * 4, LOW).all()
    unknown = lid_depth(np.full(curve.shape, np.nan), STEP)
    assert pulses_that_close(unknown, PEAKS, [BLINK] * 4, LOW).all()
    assert as_deep_as_others(unknown, PEAKS).all()
    assert has_closed_level(unknown, unknown, unknown, PEAKS)


@pytest.mark.parametrize("reach", [0.5, 1.0])
def test_a_pulse_that_is_solved_less_deep_than_the_others_leaves_the_eye_open(
    reach: float,
) -> None:
    solved = lid_depth(reach * pulses([1.0, 0.5, 0.9, 1.0]), STEP)
    assert as_deep_as_others(solved, PEAKS).tolist() == [True, False, True, True]


def test_one_of_few_blinks_that_squeezes_the_lids_does_not_make_squints_of_the_others() -> None:
    solved = lid_depth(pulses([0.52, 0.38, 0.48, 0.73]), STEP)
    assert as_deep_as_others(solved, PEAKS).all()


def test_a_ripple_on_lids_that_hang_closes_no_eye() -> None:
    depth = lid_depth(0.6 + pulses([0.4, 0.4, 0.1, 0.35]), STEP)
    assert pulses_that_close(depth, PEAKS, [BLINK] * 4, LOW).tolist() == [True, True, False, True]


@pytest.mark.parametrize(("taken", "closed"), [(0.34, True), (0.28, False)])
def test_a_pulse_of_the_markers_as_high_as_blinks_is_one(taken: float, closed: bool) -> None:
    """Though the lids seem open, unless less of their opening is taken away."""
    drift = np.where(TIMES > 4.5, 0.13, 0.0)[:, None]
    depth = lid_depth(pulses([0.5, 0.5, 0.5, taken]) - drift, STEP)
    blinks = [BLINK] * 4
    low, high = (np.array([1.0, 1.0, 1.0, height]) for height in (0.6, 0.75))
    assert not pulses_that_close(depth, PEAKS, blinks, low)[3]
    assert pulses_that_close(depth, PEAKS, blinks, high)[3] == closed


def test_a_solve_that_hardly_shows_blinks_is_not_asked() -> None:
    curve = 0.2 * pulses([1.0, 0.3, 0.0, 1.0])
    assert as_deep_as_others(lid_depth(curve, STEP), PEAKS).all()
    # Nor where it has the lids a little wider than at rest.
    assert as_deep_as_others(lid_depth(curve - 0.01, STEP), PEAKS).all()


def test_where_all_pulses_are_squints_only_those_solved_as_closed_eyes_close() -> None:
    solved = lid_depth(pulses([0.6, 0.55, 0.8, 0.6]), STEP)
    squints, blinks = (lid_depth(share * solved.gone, STEP) for share in (0.5, 0.8))
    assert as_deep_as_others(solved, PEAKS).all()  # squints are as deep as each other
    found = closed_as_solved(solved, squints, PEAKS, [BLINK] * 4)
    assert found.tolist() == [False, False, True, False]
    assert closed_as_solved(solved, blinks, PEAKS, [BLINK] * 4).all()  # lids that move less
    # Lids that the solve hardly shows, or opens, are no evidence; nor are those of no eye.
    for curve in (0.3 * solved.gone, -0.1 * solved.gone, np.full(solved.gone.shape, np.nan)):
        assert closed_as_solved(lid_depth(curve, STEP), squints, PEAKS, [BLINK] * 4).all()


def test_both_eyes_of_a_blink_are_solved_as_closed_and_the_one_of_a_wink() -> None:
    curve = pulses([0.8, 0.8, 0.8, 0.8])
    curve[:, 1] *= 0.6
    wink = replace(BLINK, eyes=(0,))
    found = closed_as_solved(
        lid_depth(curve, STEP), lid_depth(0.5 * curve, STEP), PEAKS, [BLINK, wink, BLINK, wink]
    )
    assert found.tolist() == [False, True, False, True]


def test_the_eye_that_closes_further_counts() -> None:
    winks = pulses([1.0, 1.0, 1.0, 1.0]) * [1.0, 0.0]
    assert as_deep_as_others(lid_depth(winks, STEP), PEAKS).all()


def test_only_blinks_show_the_closed_level() -> None:
    """By the closing shape; squints that take away as much of the opening do not."""
    curve = pulses([1.0, 0.9, 1.0, 1.0]) + narrowed(0.8)
    depth = lid_depth(curve, STEP)
    assert has_closed_level(depth, depth, depth, PEAKS)
    by_others = lid_depth(0.1 * curve, STEP)
    assert not has_closed_level(depth, depth, by_others, PEAKS)
    shallow = lid_depth(0.15 * pulses([1.0, 1.0, 1.0, 1.0]) + narrowed(0.8), STEP)
    assert not has_closed_level(shallow, depth, depth, PEAKS)


def test_no_pulses() -> None:
    depth, none = lid_depth(narrowed(0.8), STEP), np.zeros(0, np.int64)
    assert (
        len(pulses_that_close(depth, none, [], LOW[:0])) == len(as_deep_as_others(depth, none)) == 0
    )
