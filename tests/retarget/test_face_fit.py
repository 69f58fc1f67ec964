"""Fit of performer to character: places and map from rest and motion, also in a whole solve."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from skins import RATE, Head, make_head

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.marker_surface import MarkerSurface
from usdface.options import MapOptions, SolveOptions, SolvePlaces
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.face_fit import (
    TRANSFER,
    FaceFit,
    PlacedFit,
    fit_face,
    fit_in_head_space,
    fit_places,
)
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.places import guess_at_rest
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

HEAD = make_head()
SHIFTS = HEAD.beside(0.003, seed=5)
MARKERS, SHAPES = len(SHIFTS), len(HEAD.mesh.shapes)
NAMES = tuple(f"m{i}" for i in range(MARKERS))
NEUTRAL = 9


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def bound() -> BlendShapeEvaluator:
    return evaluator_of(HEAD.mesh.shapes, HEAD.vertices)[0]


def fitted(positions: np.ndarray, surface: MarkerSurface | None, **options: object) -> FaceFit:
    evidence = MotionEvidence(HEAD.times, positions)
    settings = MapOptions(**options)  # type: ignore[arg-type]
    return fit_face(positions[0], HEAD.points, bound(), settings, evidence, surface)


def bend(positions: np.ndarray) -> np.ndarray:
    """Carry markers to another, smooth face."""
    return positions + 0.003 * np.sin(25.0 * positions[..., [1, 2, 0]])


def on_its_vertices(fit: FaceFit) -> bool:
    same = np.array_equal(fit.evaluator.offsets, bound().offsets)
    return not isinstance(fit, PlacedFit) and not fit.shifts.any() and same


def test_markers_of_an_equal_face_sit_on_their_vertices_to_the_last_bit() -> None:
    positions = HEAD.performed(np.zeros_like(SHIFTS))
    fit = fitted(positions, HEAD.surface)
    assert on_its_vertices(fit) and fit.choice.name == "similarity"
    np.testing.assert_array_equal(fit.points, HEAD.points)
    assert on_its_vertices(fitted(1300.0 * positions + 5.0, HEAD.surface))


@pytest.mark.parametrize("case", ["image", "paper", "no surface"])
def test_images_the_papers_map_and_bound_markers_have_no_places(case: str) -> None:
    positions = HEAD.performed(SHIFTS)
    options: dict[str, object] = {"form": "paper"} if case == "paper" else {}
    if case == "image":
        positions = 4000.0 * positions[..., :2]
    fit = fitted(positions, None if case == "no surface" else HEAD.surface, **options)
    assert on_its_vertices(fit)
    np.testing.assert_array_equal(fit.points, HEAD.points)


def test_places_that_rest_shows_and_motion_confirms_are_taken_at_once() -> None:
    fit = fitted(HEAD.performed(SHIFTS), HEAD.surface)
    assert rms(fit.shifts - SHIFTS) < 0.5 * rms(SHIFTS)
    assert isinstance(fit, PlacedFit)
    np.testing.assert_array_equal(fit.points, fit.placed.points)


def test_places_that_motion_contradicts_are_not_taken() -> None:
    """At rest the face looks like one with markers 3 mm beside; it moves like one without."""
    moved = HEAD.performed(np.zeros_like(SHIFTS)) - HEAD.points
    fit = fitted(HEAD.surface.at(SHIFTS).points + moved, HEAD.surface)
    assert isinstance(fit, PlacedFit) and not fit.shifts.any()
    assert not fit.guess.mean.any() and fit.guess.spread == pytest.approx(0.0017, rel=0.4)


def test_no_place_is_further_away_than_the_reach() -> None:
    positions, reach = HEAD.performed(SHIFTS), HEAD.surface.reach
    evidence = MotionEvidence(HEAD.times, positions)
    guess = guess_at_rest(positions[0], HEAD.points)
    far = 10.0 * SHIFTS
    fit = fit_places(positions[0], far, MapOptions(), evidence, HEAD.surface, guess)
    length = np.linalg.norm(fit.shifts, axis=1)
    assert length.max() == pytest.approx(reach)
    near = np.linalg.norm(far, axis=1) < reach
    assert near.any() and not near.all()
    np.testing.assert_array_equal(fit.shifts[near], far[near])
    assert np.isfinite(fit.points).all() and np.isfinite(fit.evaluator.offsets).all()


def solved(
    positions: np.ndarray,
    *,
    places: SolvePlaces = "found",
    surface: MarkerSurface | None = HEAD.surface,
    world: Head = HEAD,
    **settings: object,
) -> Solution:
    """Solve a whole take whose first frames are neutral."""
    own = {"head": "stabilised", "neutral": (0, NEUTRAL), "solve": SolveOptions(places=places)}
    names = tuple(f"m{i}" for i in range(len(world.vertices)))
    setup = RetargetSetup(Binding(names, world.vertices), **(own | settings))  # type: ignore[arg-type]
    take = MarkerTake(names, np.arange(len(positions)) / RATE, positions, RATE)
    mesh = world.mesh
    offsets = mesh.offsets_at(world.vertices)
    return solve_take(
        take, BoundPoints.linear(world.points, offsets, mesh.shape_names), setup, surface=surface
    )[0]


def error(solution: Solution) -> float:
    return rms(solution.weights.weights - HEAD.weights)


def other_person(size: float = 3e-5) -> np.ndarray:
    """Return a take of a bent face whose markers are beside their vertices, with noise."""
    noise = np.random.default_rng(7).normal(size=(len(HEAD.weights), *SHIFTS.shape))
    return bend(HEAD.performed(SHIFTS)) + size * noise


@pytest.fixture(scope="module")
def found() -> Solution:
    return solved(other_person())


@pytest.fixture(scope="module")
def kept() -> Solution:
    return solved(other_person(), places="bound")


@pytest.mark.slow
def test_a_take_of_another_person_finds_its_places_and_better_weights(
    found: Solution, kept: Solution
) -> None:
    assert rms(found.shifts - SHIFTS) < 0.6 * rms(SHIFTS)
    assert error(found) < 0.7 * error(kept)
    assert found.misfit < 0.7 * kept.misfit


@pytest.mark.slow
def test_motion_tells_more_of_places_than_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """On another head of markers; what does not explain the motion better is not kept."""
    shifts = HEAD.beside(0.003, seed=7)
    positions = bend(HEAD.performed(shifts))
    refined = solved(positions)
    monkeypatch.setattr(importlib.import_module("usdface.retarget.refined_fit"), "_STEPS", 0)
    at_rest = solved(positions)
    assert refined.shifts is not None and at_rest.shifts is not None and at_rest.shifts.any()
    assert rms(refined.shifts - shifts) < 0.9 * rms(at_rest.shifts - shifts)
    assert refined.misfit < 0.9 * at_rest.misfit


def test_motion_finds_places_that_rest_puts_elsewhere() -> None:
    """At rest the face looks like one with markers 3 mm beside, in other directions.

    The solve cannot know that shapes do not err here, so that rest keeps some of its word.
    """
    moved = HEAD.performed(SHIFTS) - HEAD.performed(SHIFTS)[0]
    elsewhere = HEAD.beside(0.003, seed=8)
    solution = solved(HEAD.surface.at(elsewhere).points + moved)
    assert rms(solution.shifts - SHIFTS) < 0.85 * rms(SHIFTS)
    assert rms(solution.shifts - SHIFTS) < 0.65 * rms(elsewhere - SHIFTS)


def test_bound_keeps_markers_on_their_vertices(kept: Solution) -> None:
    without = solved(other_person(), surface=None)
    assert kept.shifts is not None and not kept.shifts.any()
    np.testing.assert_array_equal(kept.weights.weights, without.weights.weights)


def test_an_equal_face_solves_as_if_there_were_no_skin() -> None:
    positions = HEAD.performed(np.zeros_like(SHIFTS))
    on_skin, alone = solved(positions), solved(positions, surface=None)
    np.testing.assert_array_equal(on_skin.weights.weights, alone.weights.weights)
    assert on_skin.shifts is not None and not on_skin.shifts.any() and error(on_skin) < 1e-6


def test_an_image_solves_as_if_there_were_no_skin() -> None:
    image = 4000.0 * other_person()[..., :2]
    on_skin, alone = solved(image), solved(image, surface=None)
    np.testing.assert_array_equal(on_skin.weights.weights, alone.weights.weights)
    assert on_skin.shifts is not None and not on_skin.shifts.any()


@pytest.mark.slow
def test_occluded_markers_break_nothing(found: Solution, kept: Solution) -> None:
    """Weights change by less than half of what markers cost that are held on wrong places."""
    positions = other_person()
    positions[40:70, :6] = positions[30:, 20] = positions[90] = np.nan
    positions[2:9, 11] = np.nan  # and in the neutral
    hidden = solved(positions)
    for values in (hidden.weights.weights, hidden.shifts, hidden.feature_points, hidden.residual):
        assert np.isfinite(values).all()
    assert rms(hidden.weights.weights - found.weights.weights) < 0.5 * error(kept)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", ["take", "character", pytest.param("both", marks=pytest.mark.slow)]
)
def test_millimetres_give_the_weights_of_metres(found: Solution, case: str) -> None:
    positions, world = other_person(), HEAD
    if case in ("take", "both"):
        positions = 1000.0 * positions
    if case in ("character", "both"):
        world = scaled(1000.0)
    solution = solved(positions, world=world, surface=world.surface)
    np.testing.assert_allclose(solution.weights.weights, found.weights.weights, atol=2e-3)
    unit = 1000.0 if world is not HEAD else 1.0
    np.testing.assert_allclose(solution.shifts / unit, found.shifts, atol=2e-5)


def scaled(size: float) -> Head:
    shapes = tuple(replace(s, offsets=size * s.offsets) for s in HEAD.mesh.shapes)
    return replace(HEAD, mesh=replace(HEAD.mesh, points=size * HEAD.mesh.points, shapes=shapes))


@pytest.mark.slow
def test_places_are_found_of_a_moving_head_of_another_size() -> None:
    """With the pose solved as well: the performer nods, and is a tenth larger."""
    angle = np.radians(6) * np.sin(np.linspace(0, 7, len(HEAD.weights)) * (HEAD.times > 0.3))
    turn = np.tile(np.eye(3), (len(angle), 1, 1))
    turn[:, 1, 1] = turn[:, 2, 2] = np.cos(angle)
    turn[:, 1, 2], turn[:, 2, 1] = -np.sin(angle), np.sin(angle)
    positions = 1.1 * np.einsum("fij,fmj->fmi", turn, other_person())
    moving, kept = (
        solved(positions, places=places, head="solve", neutral=(0, 8))
        for places in ("found", "bound")
    )
    assert moving.shifts is not None and rms(moving.shifts - SHIFTS) < 0.7 * rms(SHIFTS)
    assert error(moving) < 0.8 * error(kept)


@pytest.mark.slow
def test_known_gains_find_the_places_of_a_rig_with_shapes_of_that_size() -> None:
    moved = other_person()
    larger = moved[0] + 1.6 * (moved - moved[0])
    names = HEAD.mesh.shape_names
    gains = Calibration(names, np.full(len(names), 1.6), np.zeros(len(names)))
    calibrated = solved(larger, calibration=gains)
    shapes = tuple(replace(s, offsets=1.6 * s.offsets) for s in HEAD.mesh.shapes)
    world = replace(HEAD, mesh=replace(HEAD.mesh, shapes=shapes))
    there = solved(larger, world=world, surface=world.surface)
    assert calibrated.shifts is not None and there.shifts is not None and there.shifts.any()
    np.testing.assert_allclose(calibrated.shifts, there.shifts, atol=1e-9)
    np.testing.assert_allclose(calibrated.weights.weights, there.weights.weights, atol=1e-6)


def test_a_rig_without_faces_keeps_markers_on_their_vertices() -> None:
    none = np.zeros(0, np.int64)
    mesh = replace(HEAD.mesh, face_counts=none, face_indices=none)
    solution = solved(other_person(), surface=MarkerSurface(mesh, HEAD.vertices))
    np.testing.assert_array_equal(solution.feature_points[0].shape, SHIFTS.shape)


@pytest.mark.slow
def test_a_marker_seen_in_frames_without_a_say_on_places_only_is_no_obstacle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every other frame is looked at; the marker shows in three others."""
    monkeypatch.setattr(
        importlib.import_module("usdface.retarget.fitted_take"), "_TRIAL_FRAMES", 60
    )
    positions = other_person()
    positions[:, 7] = np.nan
    positions[[1, 3, 5], 7] = other_person()[[1, 3, 5], 7]
    assert np.isfinite(solved(positions).weights.weights).all()


def other_face(positions: np.ndarray) -> np.ndarray:
    """Return a take of a face of other proportions that moves by deformation transfer."""
    patch = HEAD.surface.patch
    other = patch.points * [1.08, 0.94, 1.2]
    moved = patch.transferred(other, HEAD.mesh.offsets_at(patch.vertices))
    worn = patch.place_of[HEAD.vertices]
    return np.asarray(other[worn] + np.tensordot(HEAD.weights, moved[:, worn], 1)) + positions


@pytest.mark.slow
def test_a_face_that_moves_by_its_own_proportions_is_found_to() -> None:
    positions = other_face(2e-5 * np.random.default_rng(7).normal(size=(120, MARKERS, 3)))
    fit = fitted(positions, HEAD.surface)
    assert isinstance(fit, PlacedFit) and fit.transferred is not None
    assert fit.choice.name == TRANSFER
    shares = fit.choice.unexplained
    assert shares[TRANSFER] < 0.8 * min(v for name, v in shares.items() if name != TRANSFER)
    own, fixed = solved(positions), solved(positions, map=MapOptions(choice="fixed"))
    assert own.choice.name == TRANSFER != fixed.choice.name
    assert error(own) < 0.8 * error(fixed)


def test_a_face_whose_motion_is_bent_like_its_rest_keeps_the_map_that_bends(
    found: Solution,
) -> None:
    assert found.choice.name != TRANSFER


def test_in_head_space_displacements_are_not_bent() -> None:
    wide = HEAD.points[:, :2] * [1.2, 0.9]
    fit = fit_in_head_space(wide, HEAD.points, bound())
    moved = np.random.default_rng(2).normal(size=(5, *wide.shape))
    displaced = fit.space.displacements(wide + moved)
    np.testing.assert_allclose(displaced[..., :2], moved, atol=1e-12)
    assert not displaced[..., 2].any() and on_its_vertices(fit)
