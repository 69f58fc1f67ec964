"""Eyes that look away in a blink: the dip of a pulse is taken off, a change of gaze stays."""

import numpy as np
import pytest

from usdface.closure.blink_gaze import without_glances
from usdface.closure.eye_closing import EyeClosing

NAMES = ("eyeBlinkLeft", "eyeLookDownLeft", "eyeLookDownRight", "jawOpen")
TIMES = np.arange(0, 2, 1 / 60)
BLINK = EyeClosing("blink", (0, 1), 1.0, 1.06, 1.1, 1.26, 1.0)
FREE = np.zeros((len(TIMES), len(NAMES)))
INSIDE = (BLINK.start <= TIMES) & (BLINK.end > TIMES)
DIP = 0.5 * np.sin(np.pi * np.clip((TIMES - BLINK.start) / 0.26, 0, 1))


def weights(gaze: np.ndarray) -> np.ndarray:
    """Return weights whose eyes look down by `gaze` (F,), the right one by 0.9 of it."""
    return np.stack([0.3 * DIP, gaze, 0.9 * gaze, DIP], axis=1)


@pytest.mark.parametrize("level", [0.0, 0.2])
def test_a_dip_of_the_gaze_is_taken_off_and_nothing_else(level: float) -> None:
    steady = without_glances(weights(level + DIP), TIMES, NAMES, [BLINK], FREE)
    expected = [[0, level, 0.9 * level, 0]] + weights(DIP) * [1, 0, 0, 1]
    np.testing.assert_allclose(steady, expected, atol=1e-15)


def test_a_gaze_that_changes_in_a_blink_changes_once() -> None:
    share = np.clip((TIMES - 1.0) / 0.26, 0, 1)
    before, after = (0.1 + 0.4 * way for way in (share, share[::-1]))
    for level in (before, after):
        steady = without_glances(weights(level + DIP), TIMES, NAMES, [BLINK], FREE)[:, 1]
        assert (np.diff(steady) * np.sign(level[-1] - level[0]) >= -1e-12).all()
        np.testing.assert_array_equal(steady[~INSIDE], (level + DIP)[~INSIDE])


@pytest.mark.parametrize("way", ["Up", "In", "Out"])
def test_eyes_do_not_look_aside_or_up_either(way: str) -> None:
    names = ("eyeBlinkLeft", f"eyeLook{way}Left", f"eyeLook{way}Right", "jawOpen")
    steady = without_glances(weights(0.2 + DIP), TIMES, names, [BLINK], FREE)
    np.testing.assert_allclose(steady[:, 1:3], [[0.2, 0.18]] * len(TIMES), atol=1e-15)


def test_gaze_is_never_made_larger_and_a_second_time_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    solved = rng.random((len(TIMES), len(NAMES)))
    steady = without_glances(solved, TIMES, NAMES, [BLINK], FREE)
    assert (steady <= solved).all() and (steady < solved).any()
    again = without_glances(steady, TIMES, NAMES, [BLINK], FREE)
    np.testing.assert_array_equal(again, steady)


def test_pins_and_eyes_that_are_held_shut_stay() -> None:
    solved = weights(DIP)
    held = EyeClosing("held", (0, 1), 1.0, 1.06, 1.1, 1.26, 1.0)
    np.testing.assert_array_equal(without_glances(solved, TIMES, NAMES, [held], FREE), solved)
    pinned = np.ones_like(FREE)
    np.testing.assert_array_equal(without_glances(solved, TIMES, NAMES, [BLINK], pinned), solved)


def test_a_blink_at_either_end_of_a_take_and_a_rig_without_gaze() -> None:
    solved = weights(0.4 * np.ones(len(TIMES)))
    for start in (-0.1, 1.9):
        blink = EyeClosing("blink", (0, 1), start, start + 0.06, start + 0.1, start + 0.26, 1.0)
        steady = without_glances(solved, TIMES, NAMES, [blink], FREE)
        np.testing.assert_allclose(steady, solved, atol=1e-15)
    names = ("eyeBlinkLeft", "eyeBlinkRight", "browDownLeft", "jawOpen")
    np.testing.assert_array_equal(without_glances(solved, TIMES, names, [BLINK], FREE), solved)
