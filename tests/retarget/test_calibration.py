from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.clean_solve import calibrate, retarget
from usdface.errors import InputError
from usdface.setup import Binding, Calibration, Setup
from usdface.takes import FloatArray, MarkerTake, WeightsTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
NAMES = MESH.shape_names
SETUP = Setup(
    Binding(tuple(WORLD.points), np.array(list(WORLD.points.values()))),
    head="stabilised",
    neutral=(0, NEUTRAL - 1),
    nose_tip="nose",
)
GAINS = np.random.default_rng(3).uniform(0.8, 1.25, len(NAMES))


def performance(
    weights: FloatArray, gains: FloatArray, rest: FloatArray | None = None, seed: int = 0
) -> MarkerTake:
    """Let a performer with these gains perform, whose neutral frames may not be at rest."""
    moves = gains[:, None, None] * MESH.offsets_at(SETUP.binding.points)
    played = weights.copy()
    if rest is not None:
        played[:NEUTRAL] = rest
    places = MESH.points[SETUP.binding.points] + np.einsum("fs,smd->fmd", played, moves)
    places += 1e-4 * np.random.default_rng(seed).standard_normal(places.shape)
    return MarkerTake(SETUP.binding.markers, np.arange(len(places)) / 30, places, 30.0)


def range_of_motion() -> FloatArray:
    """Each shape to its extreme and back, one after the other."""
    beat = np.interp(np.arange(30), [0, 10, 20, 29], [0, 1, 1, 0])
    weights = np.zeros((NEUTRAL + 30 * len(NAMES), len(NAMES)))
    for k in range(len(NAMES)):
        weights[NEUTRAL + 30 * k : NEUTRAL + 30 * (k + 1), k] = beat
    return weights


def solved_error(calibration: Calibration | None, gains: FloatArray, world: World = WORLD) -> float:
    take = performance(world.weights, gains, seed=1)
    setup = replace(SETUP, calibration=calibration)
    _, weights, _, _ = retarget(take, setup, MESH, NAMES)
    return float(np.sqrt(np.mean((weights.weights - world.weights) ** 2)))


def test_a_range_of_motion_gives_the_gains_and_a_better_solve_of_another_take() -> None:
    found, _ = calibrate(performance(range_of_motion(), GAINS), SETUP, MESH, extremes=True)
    assert found.calibration.shapes == NAMES
    assert found.calibration.gains == pytest.approx(GAINS, abs=0.06)
    assert set(found.known) == set(NAMES)
    assert np.abs(found.calibration.gains - GAINS).max() < 3 * found.deviations.max()
    assert solved_error(found.calibration, GAINS) < 0.4 * solved_error(None, GAINS)


def test_true_gains_solve_another_performer_like_the_character() -> None:
    truth = Calibration(NAMES, GAINS, np.zeros(len(NAMES)))
    assert solved_error(truth, GAINS) < 1.2 * solved_error(None, np.ones(len(NAMES)))


@pytest.mark.parametrize("extremes", [False, True])
def test_where_there_is_nothing_to_calibrate_nothing_gets_worse(extremes: bool) -> None:
    same = np.ones(len(NAMES))
    weights = range_of_motion() if extremes else WORLD.weights
    found, _ = calibrate(performance(weights, same), SETUP, MESH, extremes)
    assert found.calibration.gains == pytest.approx(1.0, abs=0.05)
    assert solved_error(found.calibration, same) < solved_error(None, same) + 0.003


def test_without_extremes_a_small_movement_is_not_taken_for_a_low_gain() -> None:
    found, findings = calibrate(performance(WORLD.weights, 0.8 * np.ones(12)), SETUP, MESH)
    assert found.calibration.gains == pytest.approx(1.0, abs=0.03)
    assert not found.known
    assert "GAIN_UNKNOWN" in {f.code for f in findings}


def test_a_shape_that_never_moves_keeps_gain_1_and_is_named() -> None:
    weights = range_of_motion()
    quiet = NAMES.index("jawOpen")
    weights[:, quiet] = 0
    found, findings = calibrate(performance(weights, GAINS), SETUP, MESH, extremes=True)
    assert found.calibration.gains[quiet] == pytest.approx(1.0, abs=0.02)
    assert "jawOpen" not in found.known
    assert "jawOpen" in next(f.message for f in findings if f.code == "GAIN_UNSEEN")


def test_a_neutral_that_is_not_at_rest_is_found_and_made_good() -> None:
    rest = np.zeros(len(NAMES))
    jaw = NAMES.index("jawOpen")
    rest[jaw] = 0.1
    one = np.ones(len(NAMES))
    take = performance(range_of_motion(), one, rest)
    found, _ = calibrate(take, SETUP, MESH, extremes=True)
    assert found.calibration.offsets == pytest.approx(rest, abs=0.02)
    truth = Calibration(NAMES, one, rest)
    _, weights, _, _ = retarget(take, replace(SETUP, calibration=truth), MESH, NAMES)
    assert weights.weights[:NEUTRAL, jaw].mean() == pytest.approx(0.1, abs=0.01)
    assert np.abs(weights.weights[NEUTRAL:] - range_of_motion()[NEUTRAL:]).mean() < 0.01


def test_a_take_that_cannot_be_calibrated_on_is_refused() -> None:
    with pytest.raises(InputError, match="at least 8"):
        calibrate(performance(WORLD.weights[: NEUTRAL + 2], GAINS), SETUP, MESH)
    curves = WeightsTake(NAMES, WORLD.take.times, WORLD.weights, 30.0)
    with pytest.raises(InputError, match="markers"):
        calibrate(curves, SETUP, MESH)
