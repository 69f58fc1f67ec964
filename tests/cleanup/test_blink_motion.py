"""The motion of landmarks that recorded blinks have in common, in small films made here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.cleanup.blink_motion import blink_motion, without_blink_motion
from usdface.cleanup.clean import clean_take
from usdface.io.takes.files import read_take
from usdface.options import CleanOptions, TakeOptions
from usdface.takes import MarkerTake

RATE, FRAMES, LANDMARKS = 30.0, 300, 40
TIMES = np.arange(FRAMES) / RATE
BLINKS = (1.5, 4.0, 6.2, 8.6)
MOUTH = slice(25, 40)


def pulse(at: float, width: float = 0.06) -> FloatArray:
    return np.exp(-0.5 * ((TIMES - at) / width) ** 2)


BLINK = 0.05 + 0.2 * sum(pulse(at) for at in BLINKS)


def film(noise: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return landmarks (F, M, 2) [px] with speech and head motion, and the tracker's motion."""
    rng = np.random.default_rng(3)
    face = rng.uniform(-50.0, 50.0, (LANDMARKS, 2))
    answer = np.zeros((LANDMARKS, 2))
    answer[:12] = rng.normal(0.0, 1.5, (12, 2))
    # The tracker is a frame late.
    tracked = sum(pulse(at + 1.0 / RATE, 0.05) for at in BLINKS)[:, None, None] * answer
    moved = np.zeros((FRAMES, LANDMARKS, 2))
    moved[:, MOUTH, 1] = 4.0 * np.sin(2.0 * np.pi * 2.7 * TIMES)[:, None]
    moved += 20.0 * np.sin(0.4 * TIMES)[:, None, None]
    return face + moved + rng.normal(0.0, noise, moved.shape), tracked


def largest(motion: FloatArray) -> float:
    return float(np.linalg.norm(motion, axis=2).max())


@pytest.mark.parametrize(("noise", "left"), [(0.0, 0.4), (0.2, 0.7)])
def test_it_is_found_though_the_head_moves_and_the_mouth_speaks(noise: float, left: float) -> None:
    true, tracked = film(noise)
    found = blink_motion(true + tracked, TIMES, BLINK)
    assert largest(tracked) > 3.5
    assert largest(tracked - found) < left
    assert largest(found[:, MOUTH]) < 0.15 * 4.0  # speech stays
    away = np.abs(TIMES[:, None] - BLINKS).min(axis=1) > 0.4
    assert not found[away].any()


def test_landmarks_without_such_motion_stay() -> None:
    true, _ = film()
    assert largest(blink_motion(true, TIMES, BLINK)) < 0.4
    assert not blink_motion(true, TIMES, np.full(FRAMES, 0.3)).any()
    assert not blink_motion(true, TIMES, np.full(FRAMES, np.nan)).any()
    assert not blink_motion(true[:, :4], TIMES, BLINK).any()
    once = 0.2 * pulse(4.0)  # may as well be the performer's
    assert not blink_motion(film()[0] + film()[1], TIMES, once).any()


def test_a_raised_brow_that_lasts_is_no_blink() -> None:
    true, tracked = film()
    raised = 5.0 / (1.0 + np.exp(-(TIMES - 4.0) / 0.05))
    true[:, 13:16, 1] += raised[:, None]
    kept = true + tracked - blink_motion(true + tracked, TIMES, BLINK)
    assert np.abs(kept - true)[:, 13:16].max() < 0.5


def test_it_follows_similarities_of_the_image() -> None:
    true, tracked = film(0.2)
    turn = 1.7 * np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
    found = blink_motion(true + tracked, TIMES, BLINK)
    again = blink_motion((true + tracked) @ turn.T + [300.0, -200.0], TIMES, BLINK)
    np.testing.assert_allclose(again, found @ turn.T, atol=1e-9)


def test_blinks_with_an_occluded_landmark_stay_as_they_are() -> None:
    true, tracked = film()
    seen = true + tracked
    seen[round(4.0 * RATE), 7] = np.nan
    found = blink_motion(seen, TIMES, BLINK)
    near = np.abs(TIMES - 4.0) < 0.5
    assert not found[near].any() and largest(found[~near]) > 3.0


def take_of(positions: FloatArray, blink: FloatArray | None) -> MarkerTake:
    names = tuple(f"landmark_{i}" for i in range(positions.shape[1]))
    return MarkerTake(names, TIMES, positions, blink=blink)


def test_a_take_of_an_image_is_cleaned_of_it_and_says_so() -> None:
    true, tracked = film()
    take = take_of(true + tracked, BLINK)
    cleaned, findings = clean_take(take, take.names, CleanOptions())
    assert [each.code for each in findings] == ["BLINK_MOTION_REMOVED"]
    assert findings[0].values["marker"] in take.names[:12]
    assert findings[0].values["length_px"] == pytest.approx(largest(tracked), rel=0.15)
    assert largest(cleaned.take.positions - true) < 0.4
    assert cleaned.measured.all() and cleaned.repairs == ()
    kept, findings = clean_take(take, take.names, CleanOptions(blinks=False))
    assert kept.take is take and findings == []


def test_landmarks_that_do_not_move_are_neither_changed_nor_reported() -> None:
    """Nor is anything divided by their motion, which is rounding."""
    face = np.arange(2.0 * LANDMARKS).reshape(LANDMARKS, 2) % 7.0
    still = take_of(np.tile(face, (FRAMES, 1, 1)), BLINK)
    with np.errstate(all="raise", under="ignore"):
        assert without_blink_motion(still) == (still, [])


def test_markers_in_space_and_takes_without_recorded_blinks_stay() -> None:
    true, tracked = film()
    flat = take_of(true + tracked, None)
    assert without_blink_motion(flat) == (flat, [])
    deep = np.concatenate([true + tracked, np.zeros((FRAMES, LANDMARKS, 1))], axis=2)
    space = replace(flat, positions=deep, blink=BLINK)
    assert without_blink_motion(space) == (space, [])


def test_in_a_real_file_of_openface_only_its_two_blinks_have_such_motion(shared_data: Path) -> None:
    """By eye: landmarks of eyes, outer brows and contour from 40 and from 53 on, not lips."""
    path = shared_data / "pyfeat" / "tests_data" / "OpenFace_Test.csv"
    take, _ = read_take(path, TakeOptions(rate=30.0))
    assert isinstance(take, MarkerTake) and take.blink is not None
    lengths = np.linalg.norm(blink_motion(take.positions, take.times, take.blink), axis=2)
    blinked = np.flatnonzero(lengths.max(axis=1) > 0.5)
    assert blinked.tolist() == [40, 41, 42, 54, 55]
    eyes, mouth = slice(36, 48), slice(48, 68)
    assert lengths[:, eyes].max() > max(1.0, 4.0 * lengths[:, mouth].max())
