"""A performer's face from one take, in another one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import RATE, make_head

from usdface.findings import Finding
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibration import calibrate_take
from usdface.retarget.performed_face import (
    MatchedFace,
    fit_known_face,
    known_places,
    match_face,
)
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

HEAD = make_head()
MARKERS, NEUTRAL = len(HEAD.vertices), 10
NAMES = tuple(f"m{i}" for i in range(MARKERS))
SETUP = RetargetSetup(Binding(NAMES, HEAD.vertices), head="stabilised", neutral=(0, NEUTRAL - 1))
OFFSETS = HEAD.mesh.offsets_at(HEAD.vertices)
SHAPES = HEAD.mesh.shape_names
BOUND = BoundPoints.linear(HEAD.points, OFFSETS, SHAPES)
FRAMES = np.full(MARKERS, 10)
TURN = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix()
SHIFTS = HEAD.beside(0.002, seed=5)
PLACED = HEAD.surface.at(SHIFTS)
# Movements in other directions.
SKIN = PLACED.evaluator.offsets.reshape(len(SHAPES), -1, 3)
OWN = SKIN + 0.2 * np.cross(SKIN, [0.5, 0.3, 0.8])
FACE = PerformerFace(NAMES, HEAD.vertices, SHIFTS, PLACED.points, 10, SHAPES, OWN)


def matched(
    neutral: np.ndarray,
    face: PerformerFace = FACE,
    names: tuple[str, ...] = NAMES,
    frames: np.ndarray | None = FRAMES,
) -> tuple[MatchedFace | None, list[Finding]]:
    surface = HEAD.surface.select(np.arange(len(names)))
    return match_face(face, names, surface, neutral, frames, "take")


def fitted_again(neutral: np.ndarray, face: PerformerFace = FACE) -> tuple[MatchedFace, np.ndarray]:
    """Return the match of the face, and its fitted displacements on the character (S, M, 3)."""
    found, _ = matched(neutral, face)
    assert found is not None
    fit = fit_known_face(found, SHAPES)
    return found, fit.evaluator.offsets.reshape(OWN.shape)


def test_the_same_markers_have_their_places_and_movements_again() -> None:
    found, _ = matched(FACE.rest)
    assert found is not None and not found.moved.any()
    fit = fit_known_face(found, SHAPES)
    np.testing.assert_allclose(fit.shifts, SHIFTS, atol=1e-12)
    np.testing.assert_allclose(fit.points, PLACED.points, atol=1e-12)
    np.testing.assert_allclose(fit.evaluator.offsets, OWN.reshape(len(OWN), -1), atol=1e-12)


def test_a_performer_who_stands_elsewhere_in_other_units_is_the_same() -> None:
    found, moved = fitted_again(1000.0 * FACE.rest @ TURN.T + 7.0)
    assert not found.moved.any()
    np.testing.assert_allclose(moved, OWN, atol=1e-9)


def test_two_noisy_neutrals_are_better_than_one() -> None:
    rng = np.random.default_rng(2)
    first, second = 5e-5 * rng.normal(size=(2, MARKERS, 3))
    found, _ = matched(FACE.rest + second, replace(FACE, rest=FACE.rest + first))
    assert found is not None and found.frames is not None and (found.frames == 20).all()
    away = np.sqrt(((found.neutral - FACE.rest) ** 2).mean())
    assert away < 0.8 * np.sqrt((second**2).mean())


def test_an_exact_neutral_of_the_file_goes_before_a_noisy_one() -> None:
    noise = 5e-5 * np.random.default_rng(2).normal(size=FACE.rest.shape)
    found, _ = matched(FACE.rest + noise, replace(FACE, frames=0))
    assert found is not None
    placed = found.neutral - found.neutral.mean(axis=0)  # less the pose, which the noise turns
    away = np.sqrt(((placed - FACE.rest + FACE.rest.mean(axis=0)) ** 2).mean())
    assert away < 0.5 * np.sqrt((noise**2).mean())


def test_a_neutral_that_is_exact_is_kept() -> None:
    neutral = FACE.rest + 5e-5 * np.random.default_rng(2).normal(size=FACE.rest.shape)
    found, _ = matched(neutral, frames=None)
    assert found is not None and found.frames is None
    np.testing.assert_array_equal(found.neutral, neutral)


def test_markers_that_were_put_on_again_elsewhere_are_followed() -> None:
    """Each a millimetre or two beside: their places go along, and their movements."""
    others = SHIFTS + HEAD.beside(0.0015, seed=9)
    there = HEAD.surface.at(others)
    found, findings = matched(there.points)
    assert found is not None
    assert [f.code for f in findings] == ["PERFORMER_MARKERS_MOVED"]
    np.testing.assert_array_equal(found.neutral, there.points)
    fit = fit_known_face(found, SHAPES)
    assert np.abs(fit.shifts - others).mean() < 0.4 * np.abs(SHIFTS - others).mean()
    change = there.evaluator.offsets - PLACED.evaluator.offsets
    got = fit.evaluator.offsets - OWN.reshape(len(OWN), -1)
    assert np.abs(got - change).mean() < 0.5 * np.abs(change).mean()


@pytest.mark.parametrize("stretch", [[1.06, 1.0, 1.0], [1.0, 0.94, 1.0], [1.03, 1.0, 0.96]])
def test_another_person_is_told(stretch: list[float]) -> None:
    """Of the same size, with other proportions."""
    noise = 5e-5 * np.random.default_rng(2).normal(size=FACE.rest.shape)
    found, findings = matched((FACE.rest * stretch + noise) @ TURN.T)
    assert found is not None
    other = next(f for f in findings if f.code == "PERFORMER_OTHER")
    assert other.severity == "warning"
    assert other.values["shared_percent"] > other.values["limit_percent"] == pytest.approx(0.3)


@pytest.mark.parametrize("shown", [{}, {0: 0.2}, {1: 0.15, 2: 0.1}])
@pytest.mark.parametrize("beside", [0.0, 0.001, 0.003])
def test_the_same_person_is_not_another(shown: dict[int, float], beside: float) -> None:
    """With markers that were put on again, in another size, showing something."""
    noise = 5e-5 * np.random.default_rng(3).normal(size=FACE.rest.shape)
    moved = sum((w * OWN[k] for k, w in shown.items()), np.zeros_like(FACE.rest))
    there = HEAD.surface.at(SHIFTS + HEAD.beside(beside, seed=9)).points if beside else FACE.rest
    _, findings = matched(100.0 * (there + moved + noise) @ TURN.T)
    assert "PERFORMER_OTHER" not in {f.code for f in findings}


def test_markers_and_shapes_that_the_face_does_not_know_are_the_characters() -> None:
    few = PerformerFace(
        NAMES[:20], HEAD.vertices[:20], SHIFTS[:20], FACE.rest[:20], 10, ("x", *SHAPES[1:]),
        np.concatenate([OWN[:1], OWN[1:]])[:, :20],
    )  # fmt: skip
    neutral = HEAD.points.copy()
    neutral[:20] = FACE.rest[:20]
    found, findings = matched(neutral, few)
    assert found is not None and found.known.tolist() == list(range(20))
    assert [f.code for f in findings] == ["PERFORMER_UNMATCHED"]
    assert NAMES[20] in findings[0].message and NAMES[19] not in findings[0].message
    fit = fit_known_face(found, SHAPES)
    moved = fit.evaluator.offsets.reshape(OWN.shape)
    np.testing.assert_array_equal(moved[:, 20:], OFFSETS[:, 20:])
    np.testing.assert_allclose(moved[1:, :20], OWN[1:, :20], rtol=0.02, atol=1e-5)
    np.testing.assert_array_equal(moved[0, :20], PLACED.evaluator.offsets[0].reshape(-1, 3)[:20])


def test_known_places_are_sure_and_others_as_rest_has_them() -> None:
    shifts = HEAD.beside(0.004, seed=5)
    rest = HEAD.surface.at(shifts).points
    few = PerformerFace(
        NAMES[:20], HEAD.vertices[:20], shifts[:20], rest[:20], 10, SHAPES, OWN[:, :20]
    )
    found, _ = matched(rest, few)
    assert found is not None
    guess = known_places(found, HEAD.points)
    assert guess is not None
    np.testing.assert_allclose(guess.mean[:20], shifts[:20], atol=1e-12)
    assert not guess.mean[20:].any()
    deviations = np.sqrt(np.diag(guess.covariance)).reshape(-1, 3)
    assert deviations[:20].max() < 0.7 * guess.spread
    np.testing.assert_allclose(deviations[20:], guess.spread)


def test_there_are_no_places_where_rest_says_nothing_of_them() -> None:
    same = replace(FACE, shifts=np.zeros_like(SHIFTS), rest=HEAD.points)
    found, _ = matched(HEAD.points, same)
    assert found is not None and known_places(found, HEAD.points) is None
    assert known_places(found, np.repeat(HEAD.points, 10, axis=0)) is None


def test_a_face_of_other_vertices_is_not_worn() -> None:
    found, findings = matched(FACE.rest, replace(FACE, vertices=FACE.vertices + 1))
    assert found is None and [f.code for f in findings] == ["PERFORMER_UNMATCHED"]


def take_of(weights: np.ndarray, seed: int) -> MarkerTake:
    """Let another person perform: own shapes, markers beside, noise."""
    still = np.concatenate([np.zeros((NEUTRAL, weights.shape[1])), weights])
    positions = FACE.rest + np.tensordot(still, OWN, 1)
    positions = positions + 5e-5 * np.random.default_rng(seed).normal(size=positions.shape)
    return MarkerTake(NAMES, np.arange(len(positions)) / RATE, positions, RATE)


def solved(take: MarkerTake, calibration: Calibration | None) -> tuple[Solution, list[Finding]]:
    setup = replace(SETUP, calibration=calibration)
    return solve_take(take, BOUND, setup, surface=HEAD.surface)


@pytest.fixture(scope="module")
def learned() -> tuple[Calibration, list[Finding]]:
    first = take_of(HEAD.weights, 1)
    found, findings = calibrate_take(first, BOUND, SETUP, surface=HEAD.surface)
    return found.calibration, findings


@pytest.mark.slow
def test_a_short_take_of_a_known_performer_is_solved_better(
    learned: tuple[Calibration, list[Finding]],
) -> None:
    calibration, _ = learned
    assert calibration.face is not None and calibration.face.markers == NAMES
    truth = HEAD.weights[60:90, ::-1]
    take = take_of(truth, 2)
    errors = []
    face = Calibration((), np.zeros(0), np.zeros(0), calibration.face)
    for known in (None, face):
        solution, _ = solved(take, known)
        errors.append(np.sqrt(((solution.weights.weights[NEUTRAL:] - truth) ** 2).mean()))
    assert errors[1] < 0.85 * errors[0]


def test_shapes_of_a_file_that_the_take_contradicts_are_left_and_its_places_used() -> None:
    """The performer moves as the character does; the file has it turned."""
    truth = HEAD.weights[60:90]
    still = np.concatenate([np.zeros((NEUTRAL, len(SHAPES))), truth])
    positions = FACE.rest + np.tensordot(still, SKIN, 1)
    positions = positions + 5e-5 * np.random.default_rng(4).normal(size=positions.shape)
    take = MarkerTake(NAMES, np.arange(len(positions)) / RATE, positions, RATE)
    turned = replace(FACE, displacements=SKIN + 0.4 * np.cross(SKIN, [0.5, 0.3, 0.8]))
    right = replace(FACE, displacements=SKIN)
    weights, codes = [], []
    for face in (turned, right):
        solution, findings = solved(take, Calibration((), np.zeros(0), np.zeros(0), face))
        weights.append(solution.weights.weights[NEUTRAL:])
        codes.append([f.code for f in findings])
        assert np.abs(solution.shifts - SHIFTS).max() < 0.3 * np.abs(SHIFTS).max()
    assert "PERFORMER_SHAPES_UNUSED" in codes[0] and "PERFORMER_SHAPES_UNUSED" not in codes[1]
    away = [np.sqrt(((own - truth) ** 2).mean()) for own in weights]
    assert away[0] < 1.3 * away[1]


@pytest.mark.slow
def test_bound_markers_wear_no_face(learned: tuple[Calibration, list[Finding]]) -> None:
    take = take_of(HEAD.weights[:20], 2)
    bound = replace(SETUP, solve=replace(SETUP.solve, places="bound"))
    gains = replace(learned[0], face=None)
    one, two = (
        solve_take(
            take, BOUND, replace(bound, calibration=known),
            surface=HEAD.surface,
        )[0]
        for known in (learned[0], gains)
    )  # fmt: skip
    np.testing.assert_array_equal(one.weights.weights, two.weights.weights)


@pytest.mark.slow
def test_shapes_that_the_take_does_not_show_are_named() -> None:
    weights = HEAD.weights.copy()
    weights[:, 3] = 0.0
    take = take_of(weights, 1)
    found, findings = calibrate_take(take, BOUND, SETUP, surface=HEAD.surface)
    (unknown,) = [f for f in findings if f.code == "DIRECTION_UNKNOWN"]
    assert SHAPES[3] in unknown.message and found.calibration.face is not None
