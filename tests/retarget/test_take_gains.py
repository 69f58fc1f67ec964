"""Gains that a take itself shows: movements beyond the character's, and only those."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, make_world

from usdface.face.bound_face import bound_face
from usdface.options import PERFORMER_GAIN_RANGE, SolveOptions
from usdface.retarget.take_gains import take_gains
from usdface.retarget_take.clean_and_solve import clean_and_solve
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
NAMES = MESH.shape_names
SETUP = RetargetSetup(
    Binding(tuple(WORLD.points), np.array(list(WORLD.points.values()))),
    head="stabilised",
    neutral=(0, NEUTRAL - 1),
    nose_tip="nose",
    solve=SolveOptions(places="bound"),
)
FACE = bound_face(MESH, SETUP)
JAW = NAMES.index("jawOpen")
GIVEN = SolveOptions(gains="given", places="bound")


def played(gain: float) -> tuple[MarkerTake, np.ndarray]:
    """Let the jaw open wholly, `gain` times as far as the character's."""
    weights = WORLD.weights.copy()
    seconds = np.arange(len(weights) - NEUTRAL) / 30
    weights[NEUTRAL:, JAW] = 0.5 - 0.5 * np.cos(2 * np.pi * seconds)
    gains = np.where(np.arange(len(NAMES)) == JAW, gain, 1.0)
    places = MESH.points[SETUP.binding.points] + np.einsum(
        "fs,smd->fmd", gains * weights, MESH.offsets_at(SETUP.binding.points)
    )
    places += 1e-4 * np.random.default_rng(0).standard_normal(places.shape)
    take = MarkerTake(SETUP.binding.markers, np.arange(len(places)) / 30, places, 30.0)
    return take, weights


def error(take: MarkerTake, truth: np.ndarray, setup: RetargetSetup) -> tuple[float, list[str]]:
    _, found, _, findings = clean_and_solve(take, FACE, setup)
    return float(np.sqrt(np.mean((found.weights - truth) ** 2))), [f.code for f in findings]


def test_a_peak_that_may_be_1_is_no_gain() -> None:
    peaks, deviations = np.array([0.2, 0.999, 1.02, 1.04]), np.array([0.0, 0.0, 0.02, 0.05])
    np.testing.assert_array_equal(take_gains(peaks, deviations), 1.0)


def test_a_peak_that_is_surely_beyond_is_the_least_gain() -> None:
    peaks = np.array([1.1, 1.3, 1.6, 9.0])
    found = take_gains(peaks, np.full(4, 0.01))
    assert found[:3] == pytest.approx(peaks[:3], abs=0.03)
    assert found[3] == PERFORMER_GAIN_RANGE[1]


def test_gains_are_continuous_in_the_peak() -> None:
    found = take_gains(np.linspace(0.9, 1.4, 501), np.full(501, 0.03))
    # A peak that is 0.001 higher changes the posterior by a step of its grid, 0.005.
    assert (np.diff(found) >= 0).all() and np.diff(found).max() < 0.012


@pytest.mark.slow
def test_a_movement_beyond_the_characters_is_not_cut_off() -> None:
    take, truth = played(1.3)
    own, codes = error(take, truth, SETUP)
    cut, plain = error(take, truth, replace(SETUP, solve=GIVEN))
    named, _ = error(
        take, truth, replace(SETUP, calibration=Calibration(("jawOpen",), [1.3], [0.0]))
    )
    assert own < 0.5 * cut and own < 1.5 * named
    assert codes.count("GAIN_FOUND") == 1 and "GAIN_FOUND" not in plain


@pytest.mark.parametrize("gain", [1.0, 0.8])
def test_a_movement_as_large_or_smaller_is_solved_as_ever(gain: float) -> None:
    take, _ = played(gain)
    solved = [
        clean_and_solve(take, FACE, setup)[1].weights
        for setup in (SETUP, replace(SETUP, solve=GIVEN))
    ]
    np.testing.assert_array_equal(*solved)


def test_a_gain_of_the_performers_file_is_kept_where_it_is_enough() -> None:
    take, truth = played(1.3)
    known = replace(SETUP, calibration=Calibration(("jawOpen",), [1.35], [0.0]))
    assert error(take, truth, known) == error(take, truth, replace(known, solve=GIVEN))
