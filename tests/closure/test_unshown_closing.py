"""One eye that is solved as narrowed without its markers is opened; winks and blinks stay."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.closure.even_times import even_times
from usdface.closure.unshown_closing import (
    opened_findings,
    shown_closing,
    without_unshown_closing,
)

TIMES = np.arange(240) / 60.0
# Weights of a left and a right shape that close the eyes, and of one other.
APERTURES: Any = {"left": SimpleNamespace(closer=0), "right": SimpleNamespace(closer=1)}
HILL = np.exp(-(((TIMES - 2.0) / 0.4) ** 2))
NONE = np.zeros_like(HILL)
FREE = np.zeros((len(TIMES), 3))


def opened(
    left: FloatArray, right: FloatArray, signal: FloatArray, own: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return weights (F, 3) before and after; `signal` and `own` (F,) are of the left eye."""
    weights = np.stack([left, right, HILL], axis=1)
    both = np.stack([signal, NONE], axis=1)
    alone = None if own is None else np.stack([own, NONE], axis=1)
    shown = shown_closing(both, alone, even_times(TIMES))
    return weights, without_unshown_closing(weights, weights, shown, APERTURES, FREE)


def test_an_eye_without_evidence_is_opened_and_reported() -> None:
    before, after = opened(0.4 * HILL, NONE, -0.3 * HILL)
    assert after[:, 0].max() == pytest.approx(0.05)
    np.testing.assert_array_equal(after[:, 1:], before[:, 1:])
    (found,) = opened_findings(before, after, APERTURES)
    assert found.code == "EYE_OPENED" and found.where == "left eye"
    assert found.values["weight"] == pytest.approx(0.35, abs=0.01)


@pytest.mark.parametrize(
    ("right", "signal", "own"),
    [
        (NONE, 0.5 * HILL, None),  # a wink
        (NONE, -0.3 * HILL, 0.5 * HILL),  # under a raised brow
        (0.4 * HILL, -0.3 * HILL, None),  # both eyes
        (NONE, np.full_like(HILL, np.nan), None),  # not measured
    ],
)
def test_a_closing_that_is_shown_shared_or_not_measured_stays(
    right: FloatArray, signal: FloatArray, own: FloatArray | None
) -> None:
    before, after = opened(0.4 * HILL, right, signal, own)
    np.testing.assert_array_equal(before, after)
    assert not opened_findings(before, after, APERTURES)


@pytest.mark.parametrize("own", [-0.3, 0.0, 0.1, 0.4])
def test_a_brow_that_drags_the_marker_down_shows_no_closed_lid(own: float) -> None:
    """A frown brings the lid's marker down as far as a blink; the lid itself hardly moves."""
    _, after = opened(0.4 * HILL, NONE, 1.4 * HILL, own * HILL)
    assert after[:, 0].max() == pytest.approx(0.05)


def test_a_marker_that_moves_less_than_in_any_blink_shows_no_closed_lid() -> None:
    _, after = opened(0.4 * HILL, NONE, 0.14 * HILL)
    assert after[:, 0].max() == pytest.approx(0.05)


def test_a_closing_that_drags_the_skin_along_stays() -> None:
    """A wink draws the brow down, too: the lid's own part of the motion is half of it."""
    before, after = opened(0.4 * HILL, NONE, 0.7 * HILL, 0.35 * HILL)
    np.testing.assert_array_equal(before, after)


def test_a_second_time_changes_nothing_and_noise_makes_no_jitter() -> None:
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(TIMES))
    before, after = opened(0.4 * HILL, NONE, 0.05 * HILL + noise)
    again = opened(after[:, 0], after[:, 1], 0.05 * HILL + noise)[1]
    np.testing.assert_array_equal(again, after)
    assert np.abs(np.diff(after[:, 0])).max() < 2.0 * np.abs(np.diff(before[:, 0])).max()


def test_pins_a_single_shape_for_both_eyes_and_single_frames_stay() -> None:
    weights = np.stack([0.4 * HILL, NONE, HILL], axis=1)
    shown = shown_closing(np.zeros((len(TIMES), 2)), None, even_times(TIMES))
    pinned = without_unshown_closing(weights, weights, shown, APERTURES, np.ones_like(FREE))
    np.testing.assert_array_equal(pinned, weights)
    shared: Any = {"left": APERTURES["left"], "right": APERTURES["left"]}
    np.testing.assert_array_equal(
        without_unshown_closing(weights, weights, shown, shared, FREE), weights
    )
    assert np.isinf(shown_closing(np.zeros((1, 2)), None, even_times(np.zeros(1)))).all()


def test_an_exaggerated_eye_is_judged_as_it_was_performed() -> None:
    """A wink that its markers show stays; one that they do not falls in proportion."""
    performed = np.stack([0.4 * HILL, NONE, HILL], axis=1)
    exaggerated = performed * [2.0, 1.0, 1.0]
    for signal, share in ((0.3 * HILL, 1.0), (NONE, 0.05 / 0.4)):
        shown = shown_closing(np.stack([signal, NONE], axis=1), None, even_times(TIMES))
        after = without_unshown_closing(exaggerated, performed, shown, APERTURES, FREE)
        assert after[:, 0].max() == pytest.approx(0.8 * share, abs=1e-9)


def test_an_eye_is_opened_as_far_as_the_other_where_the_correction_closes_both() -> None:
    solved = np.stack([0.4 * HILL, NONE, HILL], axis=1)
    corrected = solved + np.outer(HILL, [0.5, 0.5, 0.0])
    shown = shown_closing(np.stack([NONE, NONE], axis=1), None, even_times(TIMES))
    after = without_unshown_closing(corrected, solved, shown, APERTURES, FREE)
    assert after[:, 0].max() == pytest.approx(0.55, abs=1e-3)
    assert (after[:, 0] >= corrected[:, 1]).all() and (after <= corrected).all()
    np.testing.assert_array_equal(after[:, 1:], corrected[:, 1:])


def test_what_was_opened_stays_in_a_second_run_by_the_same_solve() -> None:
    solved = np.stack([0.4 * HILL, NONE, HILL], axis=1)
    shown = shown_closing(np.stack([NONE, NONE], axis=1), None, even_times(TIMES))
    once = without_unshown_closing(solved, solved, shown, APERTURES, FREE)
    again = without_unshown_closing(once, solved, shown, APERTURES, FREE)
    np.testing.assert_allclose(again, once, atol=1e-12, rtol=0)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("signal", [0.0, 0.1])
def test_an_eye_is_opened_once(factor: float, signal: float) -> None:
    """Markers that show a part of a closing lower it to that part, not in each run further."""
    solved = np.stack([0.4 * HILL, NONE, HILL], axis=1)
    exaggerated = solved * [factor, factor, 1.0]
    shown = shown_closing(np.stack([signal * HILL, NONE], axis=1), None, even_times(TIMES))
    runs = [exaggerated]
    for _ in range(2):
        opened_once = without_unshown_closing(
            runs[-1], solved, shown, APERTURES, FREE, exaggerated=exaggerated
        )
        runs.append(opened_once)
    assert (runs[0] - runs[1]).max() > 0.02
    np.testing.assert_allclose(runs[2], runs[1], atol=1e-12, rtol=0)


def test_a_weight_that_is_solved_next_to_0_stays() -> None:
    solved = np.full((len(TIMES), 3), 1e-310)
    corrected = np.full((len(TIMES), 3), 0.5)
    shown = shown_closing(np.stack([NONE, NONE], axis=1), None, even_times(TIMES))
    after = without_unshown_closing(corrected, solved, shown, APERTURES, FREE)
    np.testing.assert_array_equal(after, corrected)
