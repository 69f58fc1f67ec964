import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.performed_directions import PerformedDirections, learn_directions

RNG = np.random.default_rng(1)
FRAMES, SHAPES = 200, 5
# Markers on a patch of a few centimetres, about their middle; three shapes over parts of it.
POINTS = (
    0.05 * np.stack(np.meshgrid(*2 * [np.linspace(-1, 1, 4)]), -1).reshape(-1, 2) @ np.eye(2, 3)
)
MARKERS = len(POINTS)
BUMPS = np.exp(-(((POINTS - POINTS[[0, 3, 6, 9, 12], None]) / 0.05) ** 2).sum(axis=2))
EXPECTED = 0.01 * BUMPS[..., None] * RNG.normal(size=(SHAPES, 1, 3))
WEIGHTS = np.abs(RNG.normal(size=(FRAMES, SHAPES))) * (RNG.random((FRAMES, SHAPES)) < 0.5)
NO_HEAD = np.zeros((3 * MARKERS, 0))
# Deviations as a face has them: smooth, across the shape's own direction.
DEVIATION = 0.05 * np.cross(EXPECTED, [0.3, 0.2, 0.9])
TINY = 1e-9


def learned(
    residual: np.ndarray,
    weights: np.ndarray = WEIGHTS,
    *,
    noise: float = TINY,
    misfit: float = 0.0,
    rigid: np.ndarray = NO_HEAD,
) -> PerformedDirections:
    left = residual.reshape(len(weights), MARKERS, 3)
    return learn_directions(EXPECTED, POINTS, weights, left, rigid, noise=noise, misfit=misfit)


def moved(deviation: np.ndarray, weights: np.ndarray = WEIGHTS) -> np.ndarray:
    return weights @ deviation.reshape(SHAPES, -1)


def off(found: PerformedDirections, deviation: np.ndarray) -> float:
    """Return the error of the displacements, as a share of the deviation's size."""
    error = found.displacements - EXPECTED - deviation
    return float(np.abs(error).max() / np.abs(DEVIATION).max())


def test_without_noise_the_directions_come_back() -> None:
    found = learned(moved(DEVIATION))
    assert off(found, DEVIATION) < 1e-4
    assert found.known.all() and found.shares.max() < 1e-3


def test_without_residuals_the_shapes_are_those_expected() -> None:
    found = learned(np.zeros((FRAMES, 3 * MARKERS)), noise=3e-4)
    np.testing.assert_allclose(found.displacements, EXPECTED, atol=1e-15)


@pytest.mark.parametrize("frames", [0, 1])
def test_a_take_that_shows_nothing_leaves_everything_open(frames: int) -> None:
    found = learned(np.zeros((frames, 3 * MARKERS)), np.ones((frames, SHAPES)))
    np.testing.assert_allclose(found.displacements, EXPECTED, atol=1e-15)
    assert not found.known.any()


def test_a_take_of_one_shape_leaves_the_others() -> None:
    weights = np.zeros_like(WEIGHTS)
    weights[:, 2] = WEIGHTS[:, 2]
    found = learned(moved(DEVIATION, weights), weights)
    np.testing.assert_array_equal(np.delete(found.displacements, 2, 0), np.delete(EXPECTED, 2, 0))
    np.testing.assert_allclose((found.displacements - EXPECTED)[2], DEVIATION[2], atol=1e-7)
    assert found.known.tolist() == [False, False, True, False, False]


def test_the_neutrals_error_is_not_taken_for_movement() -> None:
    constant = 0.001 * RNG.normal(size=3 * MARKERS)
    assert off(learned(moved(DEVIATION) + constant), DEVIATION) < 1e-4


def test_how_far_a_shape_goes_is_not_learned() -> None:
    """A performer who makes every movement larger: that is a gain."""
    found = learned(moved(0.2 * EXPECTED))
    assert off(found, np.zeros_like(EXPECTED)) < 0.02


def test_head_motion_is_not_taken_for_movement() -> None:
    rigid = motion_basis(POINTS, 3)
    shaken = moved(DEVIATION) + WEIGHTS @ RNG.normal(size=(SHAPES, 6)) @ rigid.T * 0.01
    one, two = learned(moved(DEVIATION), rigid=rigid), learned(shaken, rigid=rigid)
    np.testing.assert_allclose(one.displacements, two.displacements, atol=1e-7)


def test_more_noise_is_believed_less_and_misfit_less_than_noise() -> None:
    errors = {}
    for noise, misfit in ((1e-5, 0.0), (3e-4, 0.0), (3e-3, 0.0), (1e-5, 3e-4)):
        seen = learned(moved(DEVIATION), noise=noise, misfit=misfit)
        errors[noise, misfit] = (off(seen, DEVIATION), float(seen.shares.mean()))
    assert errors[1e-5, 0.0] < errors[3e-4, 0.0] < errors[3e-3, 0.0]
    assert errors[3e-4, 0.0] < errors[1e-5, 3e-4]


def test_occluded_frames_are_left_out() -> None:
    residual = moved(DEVIATION).reshape(FRAMES, MARKERS, 3)
    residual[20:40, 3] = np.nan
    kept = np.delete(np.arange(FRAMES), np.arange(20, 40))
    found = learned(residual)
    expected = learned(residual[kept], WEIGHTS[kept])
    np.testing.assert_array_equal(found.displacements, expected.displacements)
    everything = learned(np.full_like(residual, np.nan))
    np.testing.assert_allclose(everything.displacements, EXPECTED, atol=1e-15)


def test_a_performer_of_another_size_who_is_turned_makes_the_same_shapes() -> None:
    turn, size = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix(), 1000.0
    noisy = moved(DEVIATION) + 1e-4 * RNG.normal(size=(FRAMES, 3 * MARKERS))
    found = learned(noisy, noise=1e-4, misfit=3e-5)
    other = learn_directions(
        size * EXPECTED @ turn.T, size * POINTS @ turn.T + 5.0, WEIGHTS,
        size * noisy.reshape(FRAMES, MARKERS, 3) @ turn.T, NO_HEAD, noise=0.1, misfit=0.03,
    )  # fmt: skip
    np.testing.assert_allclose(other.displacements, size * found.displacements @ turn.T, atol=1e-4)
    np.testing.assert_allclose(other.shares, found.shares, rtol=1e-6)
