"""Noise and misfit of displacements as projected by a camera, and the shapes that explain it."""

from dataclasses import replace

import numpy as np
import pytest
from filmed import COUNT, FACE, VERTICES, WORLD, turning

from usdface.arrays import FloatArray
from usdface.retarget.film.projected_take import ProjectedTake
from usdface.retarget.film.views import Views

MODEL = VERTICES.marker_evaluator
COORDINATES = 2 * len(FACE)


def projected_take(
    degrees: float, noise: float = 0.0, hidden: int = 0, moving: bool = True
) -> ProjectedTake:
    """The world's displacements as a far camera sees them."""
    slopes = np.repeat(turning(degrees).rotations[:, None, :2], len(FACE), axis=1)
    certainty = np.ones((COUNT, len(FACE)))
    certainty[:hidden, 1] = 0.0
    views = Views(WORLD.take.names, slopes, certainty)
    observed = views.projected(MODEL.displacements(WORLD.weights))
    random = np.random.default_rng(3)
    observed = observed + noise * random.normal(size=observed.shape)
    return ProjectedTake(MODEL, views, observed, FACE, moving)


def solved(take: ProjectedTake) -> FloatArray:
    """The weights of each frame by plain least squares."""
    normals, right = take.equations(np.zeros_like(WORLD.weights))
    return np.linalg.solve(normals + 1e-14 * np.eye(normals.shape[1]), right[..., None])[..., 0]


@pytest.mark.parametrize("moving", [False, True])
def test_least_squares_of_each_view_are_the_weights(moving: bool) -> None:
    take = projected_take(20.0, moving=moving)
    np.testing.assert_allclose(solved(take), WORLD.weights, atol=1e-5)
    assert np.abs(take.left(np.array(WORLD.weights))).max() < 1e-12


def test_equations_about_any_weights_are_the_same_problem() -> None:
    take = projected_take(20.0, noise=1e-4)
    about = np.random.default_rng(5).uniform(size=WORLD.weights.shape)
    for one, other in zip(take.equations(0 * about), take.equations(about), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-15)


def test_small_motions_of_the_head_are_left_out() -> None:
    take = projected_take(20.0)
    shaken = replace(take, observed=take.observed + 0.01 * take.turns.sum(axis=2))
    np.testing.assert_allclose(solved(shaken), WORLD.weights, atol=1e-5)
    assert projected_take(20.0, moving=False).turns.shape == (COUNT, COORDINATES, 0)


def test_motions_of_the_head_that_no_camera_sees_take_nothing_away() -> None:
    take = projected_take(20.0)
    lengths = np.linalg.norm(take.turns, axis=1)
    np.testing.assert_allclose(lengths, [[1, 1, 1, 1, 1, 0]] * COUNT, atol=1e-12)


def test_hidden_markers_have_no_say() -> None:
    take = projected_take(20.0, hidden=20)
    wrong = take.observed.copy()
    wrong[:20, 2:4] = 0.1
    again = replace(take, observed=wrong)
    np.testing.assert_allclose(solved(again), solved(take), atol=1e-12)
    assert again.misfit(1e-4) == take.misfit(1e-4)


@pytest.mark.parametrize("hidden", [0, 20])
def test_the_noise_of_what_is_projected_is_found(hidden: int) -> None:
    take = projected_take(20.0, noise=2e-4, hidden=hidden)
    assert take.noise() == pytest.approx(2e-4, rel=0.1)
    assert projected_take(20.0).noise() < 1e-9


def test_what_lasts_and_no_shape_makes_is_misfit() -> None:
    take = projected_take(20.0, noise=2e-4)
    assert take.misfit(2e-4) == 0.0
    off = np.random.default_rng(8).normal(scale=1e-3, size=COORDINATES)
    there = replace(take, observed=take.observed + off)
    assert there.misfit(2e-4) == pytest.approx(1e-3, rel=0.35)
    assert there.noise() == pytest.approx(2e-4, rel=0.05)


def test_shares_that_nothing_explains_add_up_to_the_free_dimensions() -> None:
    take = projected_take(20.0, noise=1e-4)
    _, share = take.unexplained
    explained = np.linalg.matrix_rank(
        take.views.projected(np.broadcast_to(MODEL.offsets, (COUNT, *MODEL.offsets.shape)))[5]
    )
    # A camera far away sees five motions of the head.
    np.testing.assert_allclose(share[5].sum(), COORDINATES - explained - 5, atol=1e-3)
