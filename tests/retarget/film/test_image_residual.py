"""The residual of a film, and what poses and weights leave of it."""

from dataclasses import replace

import numpy as np
from filmed import CAMERA, COUNT, NEUTRAL, VERTICES, WORLD, filmed, placed

from usdface.arrays import FloatArray
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.image_residual import ImageResidual, image_residual

TAKE, MOTION = filmed(WORLD, 20.0)
POSE = placed(MOTION)
MOVED = WORLD.take.positions - VERTICES.rest
SURE = np.ones(TAKE.positions.shape[:2])
RNG = np.random.default_rng(2)
COLUMNS = RNG.normal(size=(COUNT, len(VERTICES.rest), 3, 2))


def residual_of(image: FloatArray, pose: Pose = POSE, moved: FloatArray = MOVED) -> ImageResidual:
    film = FilmedTake(replace(TAKE, positions=image), VERTICES, NEUTRAL)
    return image_residual(film, CAMERA, pose, VERTICES.rest, moved, SURE, 1e-6)


def test_poses_and_weights_leave_nothing_of_what_they_explain() -> None:
    off = 0.02 * RNG.normal(size=WORLD.weights.shape)
    moved = MOVED + VERTICES.marker_evaluator.displacements(off).reshape(MOVED.shape)
    shifted = Pose(POSE.rotations, POSE.translations + 0.001 * RNG.normal(size=(COUNT, 3)))
    wrong = residual_of(TAKE.positions, shifted, moved)
    # With a small variance: whole, but for the curvature of the projection.
    explained = replace(wrong, taken=residual_of(TAKE.positions, shifted, MOVED).taken)
    _, right = explained.equations(COLUMNS)
    _, naive = replace(wrong, taken=0.0 * wrong.taken).equations(COLUMNS)
    assert np.linalg.norm(right) < 0.02 * np.linalg.norm(naive)


def test_the_equations_are_those_of_the_dense_columns() -> None:
    residual = residual_of(TAKE.positions + RNG.normal(size=TAKE.positions.shape))
    normal, right = residual.equations(COLUMNS)
    count = len(VERTICES.rest)
    seen = residual.slopes @ COLUMNS
    dense = np.zeros((COUNT, count, 2, count, 2))
    dense[:, np.arange(count), :, np.arange(count)] = seen.transpose(1, 0, 2, 3)
    dense = dense.reshape(COUNT, 2 * count, 2 * count)
    taken = residual.taken.reshape(COUNT, 2 * count, -1)
    kept = np.eye(2 * count) - taken @ taken.transpose(0, 2, 1)
    np.testing.assert_allclose(normal, (dense.transpose(0, 2, 1) @ kept @ dense).sum(axis=0))
    left = residual.left.reshape(COUNT, -1, 1)
    expected = (dense.transpose(0, 2, 1) @ kept @ left).sum(axis=0)[:, 0]
    np.testing.assert_allclose(right, expected, atol=1e-9 * np.abs(expected).max())


def test_errors_of_the_shapes_are_a_covariance_over_the_frames() -> None:
    """By the dense columns and residuals."""
    off = TAKE.positions + RNG.normal(size=TAKE.positions.shape)
    offsets = VERTICES.marker_evaluator.offsets.reshape(len(WORLD.weights[0]), -1, 3)
    residual = residual_of(off).with_shape_errors(offsets, WORLD.weights, MOVED)
    repeated = residual.repeated
    assert repeated is not None
    np.testing.assert_allclose(
        repeated, WORLD.weights * repeated[-1] / WORLD.weights[-1], atol=1e-12
    )
    normal, right = residual.equations(COLUMNS)
    count = len(VERTICES.rest)
    dense = np.zeros((COUNT, count, 2, count, 2))
    dense[:, np.arange(count), :, np.arange(count)] = (residual.slopes @ COLUMNS).swapaxes(0, 1)
    taken = residual.taken.reshape(COUNT, 2 * count, -1)
    kept = np.eye(2 * count) - taken @ taken.transpose(0, 2, 1)
    dense = dense.reshape(COUNT, 2 * count, 2 * count)
    shapes = repeated.shape[1]
    along = np.einsum("fs,fij->sij", repeated, kept @ dense).reshape(shapes, -1)
    rest = np.einsum("fs,fij->sij", repeated, kept @ residual.left.reshape(COUNT, -1, 1))
    inner = np.eye(shapes) + repeated.T @ repeated
    solved = np.linalg.solve(inner, along).reshape(shapes, 2 * count, 2 * count)
    plain, alone = replace(residual, repeated=None).equations(COLUMNS)
    expected = plain - np.einsum("sik,sij->kj", along.reshape(solved.shape), solved)
    np.testing.assert_allclose(normal, expected, atol=1e-9 * np.abs(expected).max())
    expected = alone - np.einsum("sik,si->k", solved, rest[..., 0])
    np.testing.assert_allclose(right, expected, atol=1e-9 * np.abs(expected).max())
    assert np.linalg.eigvalsh(normal).min() > -1e-9 * np.abs(normal).max()


def test_a_film_without_misfit_has_no_errors_of_shapes() -> None:
    image = CAMERA.image(POSE.to_take(VERTICES.rest + MOVED))
    offsets = VERTICES.marker_evaluator.offsets.reshape(len(WORLD.weights[0]), -1, 3)
    exact = residual_of(image)
    assert exact.with_shape_errors(offsets, WORLD.weights, MOVED).repeated is None


def test_white_noise_counts_each_frame_and_a_lasting_error_fewer() -> None:
    white = residual_of(TAKE.positions + RNG.normal(size=TAKE.positions.shape))
    np.testing.assert_allclose([white.variance, white.noise], 1.0, rtol=0.25)
    lasting = residual_of(TAKE.positions + RNG.normal(size=TAKE.positions.shape[1:]))
    assert lasting.variance > 50.0 and lasting.noise < 1e-9


def test_hidden_markers_count_nothing() -> None:
    image = TAKE.positions + RNG.normal(size=TAKE.positions.shape)
    image[:, 3] = np.nan
    normal, right = residual_of(image).equations(COLUMNS)
    assert not normal[6:8].any() and not right[6:8].any()
    assert normal[:6].any()


def test_a_film_that_is_explained_exactly_has_a_residual_of_nothing() -> None:
    image = CAMERA.image(POSE.to_take(VERTICES.rest + MOVED))
    film = FilmedTake(replace(TAKE, positions=image), VERTICES, NEUTRAL)
    residual = image_residual(film, CAMERA, POSE, VERTICES.rest, MOVED, SURE, 0.0)
    assert residual.variance == 0.0 and np.isfinite(residual.taken).all()
