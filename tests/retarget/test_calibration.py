from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.face.bound_face import bound_face
from usdface.retarget.calibration import _findings
from usdface.retarget_take.calibrate import calibrate
from usdface.retarget_take.clean_and_solve import clean_and_solve
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
NAMES = MESH.shape_names
SETUP = RetargetSetup(
    Binding(tuple(WORLD.points), np.array(list(WORLD.points.values()))),
    head="stabilised",
    neutral=(0, NEUTRAL - 1),
    nose_tip="nose",
)
FACE = bound_face(MESH, SETUP)
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
    _, weights, _, _ = clean_and_solve(take, FACE, setup)
    return float(np.sqrt(np.mean((weights.weights - world.weights) ** 2)))


@pytest.mark.slow
def test_a_range_of_motion_gives_the_gains_and_a_better_solve_of_another_take() -> None:
    found, _ = calibrate(performance(range_of_motion(), GAINS), FACE, SETUP, extremes=True)
    assert found.calibration.shapes == NAMES
    assert found.calibration.gains == pytest.approx(GAINS, abs=0.06)
    assert set(found.known) == set(NAMES)
    assert np.abs(found.calibration.gains - GAINS).max() < 3 * found.deviations.max()
    assert solved_error(found.calibration, GAINS) < 0.4 * solved_error(None, GAINS)


def test_true_gains_solve_another_performer_like_the_character() -> None:
    truth = Calibration(NAMES, GAINS, np.zeros(len(NAMES)))
    assert solved_error(truth, GAINS) < 1.2 * solved_error(None, np.ones(len(NAMES)))


@pytest.mark.slow
@pytest.mark.parametrize("extremes", [pytest.param(False, marks=pytest.mark.slow), True])
def test_where_there_is_nothing_to_calibrate_nothing_gets_worse(extremes: bool) -> None:
    same = np.ones(len(NAMES))
    weights = range_of_motion() if extremes else WORLD.weights
    found, _ = calibrate(performance(weights, same), FACE, SETUP, extremes=extremes)
    assert found.calibration.gains == pytest.approx(1.0, abs=0.05)
    assert solved_error(found.calibration, same) < solved_error(None, same) + 0.003


@pytest.mark.slow
def test_without_extremes_a_small_movement_is_not_taken_for_a_low_gain() -> None:
    found, findings = calibrate(performance(WORLD.weights, 0.8 * np.ones(12)), FACE, SETUP)
    assert found.calibration.gains == pytest.approx(1.0, abs=0.03)
    assert not found.known
    assert "GAIN_UNKNOWN" in {f.code for f in findings}


@pytest.mark.slow
def test_a_shape_that_never_moves_keeps_gain_1_and_is_named() -> None:
    weights = range_of_motion()
    quiet = NAMES.index("jawOpen")
    weights[:, quiet] = 0
    found, findings = calibrate(performance(weights, GAINS), FACE, SETUP, extremes=True)
    assert found.calibration.gains[quiet] == pytest.approx(1.0, abs=0.02)
    assert "jawOpen" not in found.known
    assert "jawOpen" in next(f.message for f in findings if f.code == "GAIN_UNSEEN")


@pytest.mark.slow
def test_a_neutral_that_is_not_at_rest_is_found_and_made_good() -> None:
    rest = np.zeros(len(NAMES))
    jaw = NAMES.index("jawOpen")
    rest[jaw] = 0.1
    one = np.ones(len(NAMES))
    take = performance(range_of_motion(), one, rest)
    found, _ = calibrate(take, FACE, SETUP, extremes=True)
    assert found.calibration.offsets == pytest.approx(rest, abs=0.02)
    truth = Calibration(NAMES, one, rest)
    _, weights, _, _ = clean_and_solve(take, FACE, replace(SETUP, calibration=truth))
    assert weights.weights[:NEUTRAL, jaw].mean() == pytest.approx(0.1, abs=0.01)
    assert np.abs(weights.weights[NEUTRAL:] - range_of_motion()[NEUTRAL:]).mean() < 0.01


@pytest.mark.parametrize(
    "named", [(), pytest.param(("jawOpen",), marks=pytest.mark.slow), ("jawOpen", "eyeBlinkLeft")]
)
def test_a_rest_that_is_described_twice_is_taken_off_once(named: tuple[str, ...]) -> None:
    """By the calibration and by the take's own neutral weights, or each by one of them."""
    shown = {"jawOpen": 0.12, "eyeBlinkLeft": 0.15}
    rest = np.array([shown.get(name, 0.0) for name in NAMES])  # of the character's shapes
    weights = range_of_motion()
    take = performance(weights, GAINS, rest / GAINS)
    setup = replace(
        SETUP,
        calibration=Calibration(NAMES, GAINS, rest),
        neutral_weights={name: shown[name] for name in named},
    )
    _, found, _, _ = clean_and_solve(take, FACE, setup)
    truth = np.concatenate([np.tile(rest / GAINS, (NEUTRAL, 1)), weights[NEUTRAL:]])
    assert np.abs(found.weights - truth).mean() < 0.0075  # 0.006 from a true rest
    assert found.weights[:NEUTRAL].mean(axis=0) == pytest.approx(rest / GAINS, abs=0.02)


@pytest.mark.slow
def test_the_neutral_frames_of_a_take_go_before_the_performers_habit() -> None:
    """The lids of this take's neutral hang by a fifth, those of the calibration by a tenth."""
    lid = NAMES.index("eyeBlinkLeft")
    rest, habit, one = np.zeros(12), np.zeros(12), np.ones(12)
    rest[lid], habit[lid] = 0.2, 0.1
    setup = replace(
        SETUP,
        calibration=Calibration(NAMES, one, habit),
        neutral_weights={"eyeBlinkLeft": 0.2},
    )
    take = performance(range_of_motion(), one, rest)
    _, found, _, _ = clean_and_solve(take, FACE, setup)
    assert found.weights[:NEUTRAL, lid].mean() == pytest.approx(0.2, abs=0.02)


def test_the_rigs_own_neutral_is_at_rest_whatever_the_performers_is() -> None:
    one, habit = np.ones(12), np.full(12, 0.1)
    weights = range_of_motion()
    take = performance(weights, one, habit)  # the first frames show it, and are not the neutral
    setup = replace(SETUP, neutral=None, calibration=Calibration(NAMES, one, habit))
    _, found, _, _ = clean_and_solve(take, FACE, setup)
    assert found.weights[:NEUTRAL].mean(axis=0) == pytest.approx(habit, abs=0.02)
    assert np.abs(found.weights[NEUTRAL:] - weights[NEUTRAL:]).mean() < 0.01
    calibrated, _ = calibrate(take, FACE, replace(SETUP, neutral=None), extremes=True)
    assert not calibrated.calibration.offsets.any()


@pytest.mark.slow
def test_a_calibration_finds_what_the_neutral_weights_leave_of_the_rest() -> None:
    jaw = NAMES.index("jawOpen")
    rest, one = np.zeros(12), np.ones(12)
    rest[jaw] = 0.15
    take = performance(range_of_motion(), one, rest)
    setup = replace(SETUP, neutral_weights={"jawOpen": 0.15})
    found, _ = calibrate(take, FACE, setup, extremes=True)
    assert found.calibration.offsets == pytest.approx(0.0, abs=0.02)
    assert found.calibration.gains == pytest.approx(one, abs=0.05)


def test_a_take_that_cannot_be_calibrated_on_is_refused() -> None:
    with pytest.raises(InputError, match="at least 8"):
        calibrate(performance(WORLD.weights[: NEUTRAL + 2], GAINS), FACE, SETUP)
    curves = WeightsTake(NAMES, WORLD.take.times, WORLD.weights, 30.0)
    with pytest.raises(InputError, match="markers"):
        calibrate(curves, FACE, SETUP)


@pytest.mark.parametrize("extremes", [False, True])
def test_a_range_of_motion_is_not_advised_where_the_take_is_said_to_be_one(extremes: bool) -> None:
    weights = np.zeros((NEUTRAL + 60, len(NAMES)))
    weights[NEUTRAL:, 0] = 0.4 * np.sin(np.linspace(0, np.pi, 60)) ** 2
    found, _ = calibrate(performance(weights, np.ones(len(NAMES))), FACE, SETUP, extremes=extremes)
    unsure = replace(found, deviations=np.full(len(NAMES), 0.2), peaks=np.ones(len(NAMES)))
    (unknown,) = _findings(unsure, np.zeros(len(NAMES)), "take", extremes)
    assert unknown.code == "GAIN_UNKNOWN"
    assert ("--extremes" in unknown.message) is not extremes
