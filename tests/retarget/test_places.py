"""Places of markers from rest and from motion: on a smooth head, and between two lips."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import LIP, joined_lips, make_head

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_modes import motion_basis, small_motions
from usdface.retarget.motion_errors import MotionErrors
from usdface.retarget.places import (
    PlaceGuess,
    guess_at_rest,
    guess_in_image,
    guess_in_motion,
    search_in_motion,
)

HEAD = make_head()
SHIFTS = HEAD.beside(0.003, seed=5)
WORN = HEAD.surface.at(SHIFTS).points
MARKERS = len(SHIFTS)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def bend(points: np.ndarray) -> np.ndarray:
    """Carry points to another, smooth face: 4 mm of bends of 8 cm and more."""
    return points + 0.004 * np.sin(30.0 * points[:, [1, 2, 0]])


def alike(spread: float) -> PlaceGuess:
    """Return the guess that markers are anywhere near their vertices."""
    none = np.zeros((MARKERS, 3))
    return PlaceGuess(none, np.eye(3 * MARKERS), spread).centred()


def test_markers_beside_their_vertices_are_found_on_a_bent_face() -> None:
    guess = guess_at_rest(bend(WORN), HEAD.points)
    assert rms(guess.mean - SHIFTS) < 0.5 * rms(SHIFTS)
    assert guess.spread == pytest.approx(rms(SHIFTS), rel=0.4)


def test_a_smooth_bend_alone_moves_no_place_by_more_than_a_fraction() -> None:
    bent = bend(HEAD.points)
    guess = guess_at_rest(bent, HEAD.points)
    most = np.linalg.norm(guess.mean, axis=1).max()
    assert most < 0.1 * np.linalg.norm(bent - HEAD.points, axis=1).max()


def test_the_guess_is_as_uncertain_as_it_errs() -> None:
    """Of faces and places drawn as the guess assumes: squared errors in the mean 1 by its measure.

    The field reaches 1.2 RMS radii and is 4 mm large, places are 2 mm off.
    """
    rng, points = np.random.default_rng(1), HEAD.points
    away = np.linalg.norm(points[:, None] - points, axis=2) / rms_radius(points)
    smooth = np.linalg.cholesky(np.exp(-((away / 1.2) ** 2) / 2) + 1e-9 * np.eye(MARKERS))
    squares = []
    for _ in range(8):
        shifts = 0.002 * rng.normal(size=(MARKERS, 3))
        field = 0.004 * smooth @ rng.normal(size=(MARKERS, 3))
        guess = guess_at_rest(points + field + shifts, points)
        values, vectors = np.linalg.eigh(guess.covariance)
        assert values.min() > -1e-12 * values.max()
        assert np.diag(guess.covariance).max() <= guess.spread**2 * (1 + 1e-9)
        known = values > 1e-3 * guess.spread**2
        off = vectors.T @ (shifts - guess.mean).ravel()
        squares.append(np.mean(off[known] ** 2 / values[known]))
    assert np.mean(squares) == pytest.approx(1.2, abs=0.5)


@pytest.mark.parametrize("depth", [0.0, 1.0])
def test_an_image_tells_how_far_markers_are_from_their_vertices_but_not_where(depth: float) -> None:
    """Also of a plane, whose small turns an image does not show."""
    points = HEAD.points * [1.0, 1.0, depth]
    shifts = 0.002 * np.random.default_rng(8).normal(size=(MARKERS, 2))
    turned = points + 0.05 * small_motions(points, image=True)[3]
    guess = guess_in_image(turned[:, :2] + shifts, points)
    assert guess.spread == pytest.approx(0.002, rel=0.25)
    assert not guess.mean.any()
    np.testing.assert_allclose(guess.covariance, guess.spread**2 * np.eye(3 * MARKERS))


def test_rest_says_nothing_of_shifts_that_a_pose_or_size_of_the_head_explains() -> None:
    guess = guess_at_rest(bend(WORN), HEAD.points)
    centred = HEAD.points - HEAD.points.mean(axis=0)
    motions = np.concatenate([small_motions(HEAD.points, image=False), centred[None]])
    free = np.linalg.qr(motions.reshape(7, -1).T)[0]
    np.testing.assert_allclose(free.T @ guess.mean.ravel(), 0.0, atol=1e-6)
    np.testing.assert_allclose(
        free.T @ guess.covariance @ free, guess.spread**2 * np.eye(7), atol=1e-4 * guess.spread**2
    )


def test_equal_faces_leave_markers_where_they_are() -> None:
    """However large, and wherever the performer stands."""
    turn = Rotation.from_rotvec([0.2, 1.0, -0.4]).as_matrix()
    guess = guess_at_rest(1.3 * HEAD.points @ turn.T + [1.0, 2.0, 3.0], HEAD.points)
    assert guess.spread < 1e-12 and np.abs(guess.mean).max() < 1e-12
    exact = guess_at_rest(HEAD.points, HEAD.points)
    assert np.isfinite(exact.covariance).all() and exact.spread < 1e-15


def test_the_performers_size_unit_and_pose_play_no_part() -> None:
    neutral = bend(WORN)
    turn = Rotation.from_rotvec([0.2, 1.0, -0.4]).as_matrix()
    here, there = (
        guess_at_rest(n, HEAD.points) for n in (neutral, 1300 * neutral @ turn.T + [5.0, 0.0, 0.0])
    )
    np.testing.assert_allclose(there.mean, here.mean, atol=1e-9)
    np.testing.assert_allclose(there.covariance, here.covariance, atol=1e-12)


def test_places_turn_and_grow_with_the_character() -> None:
    neutral = bend(WORN)
    turn = Rotation.from_rotvec([0.2, 1.0, -0.4]).as_matrix()
    here, there = (
        guess_at_rest(neutral, points) for points in (HEAD.points, 1000 * HEAD.points @ turn.T)
    )
    np.testing.assert_allclose(there.mean, 1000 * here.mean @ turn.T, atol=1e-4)
    assert there.spread == pytest.approx(1000 * here.spread, rel=1e-4)


def test_centred_is_the_vertices_with_the_same_spread() -> None:
    guess = guess_at_rest(bend(WORN), HEAD.points).centred()
    assert not guess.mean.any()
    np.testing.assert_array_equal(guess.covariance, guess.spread**2 * np.eye(3 * MARKERS))


def of_frames(weights: np.ndarray, variance: float) -> MotionErrors:
    """Return errors that come anew in every 30 frames."""
    return MotionErrors(variance, weights, np.zeros(weights.shape[1]))


def step(
    shifts: np.ndarray, guess: PlaceGuess, performed: np.ndarray, variance: float, head: bool = True
) -> np.ndarray:
    """Return shifts one step on, the true weights known."""
    placed = HEAD.surface.at(shifts)
    neutral = HEAD.performed(SHIFTS)[0]
    rigid = motion_basis(placed.points, 3) if head else np.zeros((3 * MARKERS, 0))
    errors = of_frames(HEAD.weights, variance)
    return guess_in_motion(guess, shifts, placed, errors, performed - neutral, rigid)


def test_a_step_in_motion_finds_markers_beside_their_vertices() -> None:
    """Without noise, of a guess that knows nothing."""
    zero = np.zeros_like(SHIFTS)
    found = step(zero, alike(0.003), HEAD.performed(SHIFTS), 1e-6**2)
    assert rms(found - SHIFTS) < 0.4 * rms(SHIFTS)
    again = step(found, alike(0.003), HEAD.performed(SHIFTS), 1e-6**2)
    assert rms(again - SHIFTS) < 0.2 * rms(SHIFTS)


def test_markers_that_are_in_place_stay_there() -> None:
    guess = PlaceGuess(SHIFTS, 0.003**2 * np.eye(3 * MARKERS), 0.003)
    found = step(SHIFTS, guess, HEAD.performed(SHIFTS), 1e-5**2)
    np.testing.assert_allclose(found, SHIFTS, atol=1e-12)


def test_residuals_that_weights_or_the_head_could_explain_move_no_place() -> None:
    """Left over from a pose and weights that are off, they look like places that are."""
    zero = np.zeros_like(SHIFTS)
    placed, rng = HEAD.surface.at(zero), np.random.default_rng(3)
    moved = placed.evaluator.displacements(HEAD.weights)
    # In the way of the take's own motion, so that they would not cancel over its frames.
    sways = HEAD.weights @ rng.normal(size=(len(HEAD.weights[0]), 6))
    swaying = 1e-3 * sways @ motion_basis(HEAD.points, 3).T
    mixed = 0.02 * rng.normal(size=(HEAD.weights.shape[1],) * 2)
    wrong = placed.evaluator.displacements(HEAD.weights @ mixed)
    for off in (swaying, wrong):
        performed = HEAD.performed(SHIFTS)[0] + (moved + off).reshape(-1, MARKERS, 3)
        with_all = step(zero, alike(0.003), performed, 1e-5**2)
        still = replace(placed.skin.evaluator, offsets=0.0 * placed.skin.evaluator.offsets)
        without = replace(placed, skin=replace(placed.skin, evaluator=still))
        naive = guess_in_motion(
            alike(0.003), zero, without, of_frames(HEAD.weights, 1e-5**2),
            off.reshape(-1, MARKERS, 3), np.zeros((3 * MARKERS, 0)),
        )  # fmt: skip
        assert rms(with_all) < 0.1 * rms(naive)


def test_motion_that_is_mostly_error_leaves_the_guess() -> None:
    found = step(np.zeros_like(SHIFTS), alike(0.003), HEAD.performed(SHIFTS), 1.0)
    assert rms(found) < 1e-3 * rms(SHIFTS)
    near = PlaceGuess(SHIFTS, 0.001**2 * np.eye(3 * MARKERS), 0.001)
    found = step(np.zeros_like(SHIFTS), near, HEAD.performed(SHIFTS), 1.0)
    tangents = HEAD.surface.at(np.zeros_like(SHIFTS)).tangents
    along, expected = (np.einsum("mad,md->ma", tangents, one) for one in (found, SHIFTS))
    np.testing.assert_allclose(along, expected, atol=1e-5)


def test_more_frames_of_one_movement_are_no_more_evidence() -> None:
    """A performer whose blend shapes move in other directions: errors return with each movement."""
    zero, rng = np.zeros_like(SHIFTS), np.random.default_rng(4)
    placed = HEAD.surface.at(zero)
    offsets = placed.evaluator.offsets.reshape(HEAD.weights.shape[1], -1)
    size = 0.3 * np.sqrt((offsets**2).mean(axis=1))
    other = offsets + size[:, None] * rng.normal(size=offsets.shape)
    found = {}
    for times in (10, 100):
        weights = np.tile(HEAD.weights, (times, 1))
        displaced = (weights @ other).reshape(-1, MARKERS, 3)
        for name, variances in {"of frames": 0.0 * size, "of shapes": size**2}.items():
            errors = MotionErrors(5e-4**2, weights, variances)
            rigid = np.zeros((3 * MARKERS, 0))
            shifts = guess_in_motion(alike(0.003), zero, placed, errors, displaced, rigid)
            found[name, times] = rms(shifts)
    assert found["of frames", 100] > 1.5 * found["of frames", 10]
    assert found["of shapes", 100] < 1.2 * found["of shapes", 10]
    assert found["of shapes", 100] < 0.5 * found["of frames", 100]


def test_occluded_markers_are_found_from_what_is_seen_of_them() -> None:
    """Nine markers are seen in every tenth frame only; what is hidden says nothing of places."""
    performed = HEAD.performed(SHIFTS)
    hidden = np.arange(len(performed)) % 10 > 0
    performed[hidden, :9] = performed[90] = np.nan
    found = step(np.zeros_like(SHIFTS), alike(0.003), performed, 1e-6**2)
    assert np.isfinite(found).all()
    assert rms(found[:9] - SHIFTS[:9]) < 0.6 * rms(SHIFTS[:9])
    assert rms(found[9:] - SHIFTS[9:]) < 0.5 * rms(SHIFTS[9:])


def lips() -> tuple[MarkerSurface, np.ndarray, np.ndarray]:
    """Return a surface with a marker of the upper lip near the corner, weights, its guess."""
    ends = [0, LIP - 1, 5 * LIP, 6 * LIP - 1]
    surface = MarkerSurface(joined_lips(), np.array([3 * LIP + 1, *ends]))
    weights = np.clip(np.sin(np.arange(90) / 9.0), 0.0, 1.0)[:, None]
    return surface, weights, np.zeros((5, 3))


def unsized(shapes: BlendShapeEvaluator) -> BlendShapeEvaluator:
    """Return the shapes as a performer who is not calibrated makes them."""
    return shapes


def test_the_search_leaves_a_wrong_lip() -> None:
    """Bound to the upper lip beside the corner, the marker moves with the lower one."""
    surface, weights, none = lips()
    errors = of_frames(weights, 5e-4**2)
    guess = PlaceGuess(none, np.eye(15), 0.003).centred()
    displaced = np.zeros((90, 5, 3))
    displaced[:, 0, 1] = -0.01 * weights[:, 0]
    displaced[20:30, 0] = np.nan
    found = search_in_motion(guess, surface, 0, errors, displaced, unsized)
    vertex = np.linalg.norm(surface.mesh.points - surface.mesh.points[3 * LIP + 1] - found, axis=1)
    assert vertex.min() < 1e-12 and vertex.argmin() < 3 * LIP


def test_the_search_keeps_the_right_lip() -> None:
    surface, weights, none = lips()
    errors = of_frames(weights, 5e-4**2)
    guess = PlaceGuess(none, np.eye(15), 0.003).centred()
    displaced = np.zeros((90, 5, 3))
    found = search_in_motion(guess, surface, 0, errors, displaced, unsized)
    np.testing.assert_array_equal(found, 0.0)


def test_the_search_goes_no_further_than_the_guess_allows() -> None:
    """A marker that is known to sit on its vertex stays, however it moves."""
    surface, weights, none = lips()
    errors = of_frames(weights, 5e-4**2)
    guess = PlaceGuess(none, np.eye(15), 1e-6).centred()
    displaced = np.zeros((90, 5, 3))
    displaced[:, 0, 1] = -0.01 * weights[:, 0]
    found = search_in_motion(guess, surface, 0, errors, displaced, unsized)
    np.testing.assert_array_equal(found, 0.0)
