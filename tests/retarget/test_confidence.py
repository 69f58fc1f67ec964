from dataclasses import replace

import numpy as np
import pytest
from bands import dense
from scipy.linalg import cholesky_banded, solve_banded

from usdface.options import SolveOptions
from usdface.retarget.confidence import (
    Confidence,
    confidence_of,
    weight_deviations,
    within_bounds,
)
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.covariance import inverse_bands
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights
from usdface.retarget.solver.terms import SolverTerm

RNG = np.random.default_rng(21)
OPTIONS = SolveOptions()
STEP = 1 / 30
BASIS = 0.01 * RNG.normal(size=(4, 24))
NORMAL = BASIS @ BASIS.T


def test_deviations_are_those_of_the_whole_takes_posterior() -> None:
    """Inverted densely, the middle frame of a long take, without a ridge worth the name."""
    options = SolveOptions(spread=1e3)
    frames, noise = 61, 0.004
    curvature = dense(curvature_bands(STEP * np.arange(frames)))
    single = NORMAL + noise**2 / options.spread**2 * np.eye(4)
    whole = np.kron(np.eye(frames), single)
    whole += np.kron(noise**2 * OPTIONS.smoothness / OPTIONS.agility * curvature, np.eye(4))
    middle = slice(4 * (frames // 2), 4 * (frames // 2) + 4)
    variances = noise**2 * np.diag(np.linalg.inv(whole))[middle]
    ours = weight_deviations(NORMAL, STEP, Regularisation(noise, 0.0, options))
    np.testing.assert_allclose(ours, np.sqrt(variances), rtol=1e-3)


def test_deviations_of_one_frame_are_those_of_its_posterior() -> None:
    regularisation = Regularisation(0.003, 0.002, OPTIONS)
    spread = np.linalg.inv(NORMAL / regularisation.variance + np.eye(4) / OPTIONS.spread**2)
    ours = weight_deviations(NORMAL, 0.0, regularisation)
    np.testing.assert_allclose(ours, np.sqrt(np.diag(spread)))


@pytest.mark.parametrize("smoothness", [0.0, 1.0])
def test_deviations_are_how_far_weights_are_off(smoothness: float) -> None:
    options = SolveOptions(smoothness=smoothness)
    frames, noise = 3000, 5e-4
    times = STEP * np.arange(frames)
    truth = 0.5 + 0.2 * np.sin(np.outer(times, [0.5, 0.7, 0.9, 1.1]))
    seen = truth @ BASIS + noise * RNG.normal(size=(frames, 24))
    regularisation = Regularisation(noise, 0.0, options)
    found = solve_weights(NORMAL, seen @ BASIS.T, times, regularisation).weights
    off = np.sqrt(np.mean((found - truth) ** 2, axis=0))
    result = weight_deviations(NORMAL, STEP, Regularisation(noise, 0.0, options))
    # Slow weights are smoothed at no cost in truth, so that they are nearer than said.
    np.testing.assert_allclose(off, result, rtol=0.1 if smoothness == 0.0 else 0.5)


SHAPED = 0.02 * np.eye(4) + 0.03 * np.outer([1.0, 0.8, -0.5, 0.2], [1.0, 0.8, -0.5, 0.2])


def test_with_a_learned_covariance_they_are_those_of_its_posterior() -> None:
    frames, noise = 61, 0.004
    over_time = dense(inverse_bands(STEP * np.arange(frames), OPTIONS.pace))
    whole = np.kron(np.eye(frames), NORMAL)
    whole += np.kron(noise**2 * over_time, np.linalg.inv(SHAPED))
    middle = slice(4 * (frames // 2), 4 * (frames // 2) + 4)
    variances = noise**2 * np.diag(np.linalg.inv(whole))[middle]
    ours = weight_deviations(NORMAL, STEP, Regularisation(noise, 0.0, OPTIONS, covariance=SHAPED))
    np.testing.assert_allclose(ours, np.sqrt(variances), rtol=1e-3)


def test_with_a_learned_covariance_they_are_how_far_weights_of_the_process_are_off() -> None:
    """Drawn from the very process: shares within one and two deviations are a normal error's."""
    frames, noise = 3000, 2e-3
    times = STEP * np.arange(frames)
    wide = cholesky_banded(inverse_bands(times, OPTIONS.pace))
    drawn = solve_banded((0, 2), wide, RNG.normal(size=(frames, 4)))
    truth = 0.5 + 0.3 * drawn @ np.linalg.cholesky(SHAPED).T
    seen = (truth - 0.5) @ BASIS + noise * RNG.normal(size=(frames, 24))
    free = Bounds(np.full(4, -10.0), np.full(4, 10.0))
    learned = Regularisation(noise, 0.0, OPTIONS, covariance=0.09 * SHAPED)
    found = solve_weights(NORMAL, seen @ BASIS.T, times, learned, bounds=free).weights
    result = weight_deviations(NORMAL, STEP, learned)
    off = np.abs(found - (truth - 0.5)) / result
    assert (off < 1).mean() == pytest.approx(0.683, abs=0.02)
    assert (off < 2).mean() == pytest.approx(0.954, abs=0.01)


def test_what_no_marker_sees_is_not_learned_either() -> None:
    normal = NORMAL.copy()
    normal[2] = normal[:, 2] = 0.0
    result = weight_deviations(
        normal, STEP, Regularisation(3e-4, 0.0, OPTIONS, covariance=1e-4 * np.eye(4))
    )
    assert result[2] == pytest.approx(OPTIONS.spread, rel=1e-6)
    assert np.delete(result, 2).max() <= 0.01


def test_bounds_cut_errors_off() -> None:
    result = within_bounds(np.array([0.01, 0.01, 10.0]), np.array([[0.5, 0.005, 0.5]]))
    assert result[0] == pytest.approx(0.01)
    # Within [-1/2, oo): numbers from a table of the normal distribution.
    assert result[1] == pytest.approx(0.01 * np.sqrt(1 - 0.5 * 0.35207 / 0.69146), rel=1e-4)
    # Where nothing is known: even over [0, 1].
    assert result[2] == pytest.approx(np.sqrt(1 / 12), rel=1e-3)


NAMES = ("smileLeft", "jawOpen", "smileRight", "puff")
LEVEL = SolveOptions(symmetry=40.0)
DIFFERENCE = np.array([[1.0, 0.0, -1.0, 0.0]])


def test_symmetry_is_part_of_the_posterior_of_one_frame() -> None:
    """The right side is seen by no marker: symmetry says of it what the left side shows."""
    normal = NORMAL.copy()
    normal[2] = normal[:, 2] = 0.0
    held = Regularisation(0.003, 0.002, LEVEL, NAMES)
    expected = np.eye(4) / LEVEL.spread**2 + LEVEL.symmetry * DIFFERENCE.T @ DIFFERENCE
    posterior = np.linalg.inv(normal / held.variance + expected)
    ours = weight_deviations(normal, 0.0, held)
    np.testing.assert_allclose(ours, np.sqrt(np.diag(posterior)))
    assert ours[2] < 0.5 * weight_deviations(normal, 0.0, replace(held, names=()))[2]


def test_symmetry_is_part_of_a_learned_posterior() -> None:
    frames, noise = 61, 0.004
    whole = np.kron(np.eye(frames), NORMAL + noise**2 * 40.0 * DIFFERENCE.T @ DIFFERENCE)
    over_time = dense(inverse_bands(STEP * np.arange(frames), OPTIONS.pace))
    whole += np.kron(noise**2 * over_time, np.linalg.inv(SHAPED))
    middle = slice(4 * (frames // 2), 4 * (frames // 2) + 4)
    variances = noise**2 * np.diag(np.linalg.inv(whole))[middle]
    held = Regularisation(noise, 0.0, LEVEL, NAMES, SHAPED)
    ours = weight_deviations(NORMAL, STEP, held)
    np.testing.assert_allclose(ours, np.sqrt(variances), rtol=1e-3)


def test_with_symmetry_they_are_how_far_weights_are_off() -> None:
    """Monte Carlo: faces that are as lopsided as expected, one frame each."""
    rng = np.random.default_rng(3)
    held = Regularisation(0.01, 0.0, LEVEL, NAMES)
    truth = rng.multivariate_normal(np.zeros(4), np.linalg.inv(held.precision(4)), 4000)
    seen = truth @ BASIS + held.noise * rng.normal(size=(4000, 24))
    free = Bounds(np.full(4, -10.0), np.full(4, 10.0))
    single = replace(held, options=replace(LEVEL, mode="frame"))
    found = solve_weights(NORMAL, seen @ BASIS.T, np.arange(4000.0), single, bounds=free).weights
    off = np.sqrt(((found - truth) ** 2).mean(axis=0))
    np.testing.assert_allclose(weight_deviations(NORMAL, 0.0, held), off, rtol=0.04)


@pytest.mark.slow
@pytest.mark.parametrize(("sparsity", "noise"), [(30.0, 0.02), (8.0, 0.05), (300.0, 0.004)])
def test_weights_that_sparsity_presses_to_0_are_as_sure_as_their_posterior(
    sparsity: float, noise: float
) -> None:
    """One frame at rest, two shapes: the posterior on a grid of its box."""
    basis = 0.01 * np.random.default_rng(2).normal(size=(2, 8))
    normal, options = basis @ basis.T, SolveOptions(sparsity=sparsity, mode="frame")
    held = Regularisation(noise, 0.0, options)
    right = np.zeros((1, 2))
    found = solve_weights(normal, right, np.zeros(1), held).weights
    assert not found.any()
    axis = (np.arange(1500) + 0.5) / 1500
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    cost = 0.5 * ((grid @ normal) * grid).sum(axis=1) + held.value(grid)
    share = np.exp((cost.min() - cost) / held.variance)
    posterior = np.sqrt((share / share.sum()) @ grid**2)
    result = within_bounds(weight_deviations(normal, 0.0, held), found, held)
    np.testing.assert_allclose(result, posterior, rtol=0.1)
    assert (within_bounds(weight_deviations(normal, 0.0, held), found) > 1.5 * result).all()


def test_a_term_that_raises_presses_against_the_upper_bound() -> None:
    class Raised(SolverTerm):
        def pull(self, held: Regularisation, size: int) -> np.ndarray:
            return np.full(size, 50.0 * held.variance)

    held = Regularisation(0.3, 0.0, OPTIONS, terms=(Raised(),))
    result = within_bounds(np.full(2, 10.0), np.array([[1.0, 0.5]]), held)
    assert result[0] == pytest.approx(np.sqrt(2) / 50, rel=1e-2)
    assert result[1] == pytest.approx(np.sqrt(1 / 12), rel=1e-2)


def test_misfit_does_not_average_out() -> None:
    misfit = Regularisation(0.0, 1e-3, OPTIONS)
    alone = weight_deviations(NORMAL, 0.0, misfit)
    np.testing.assert_allclose(weight_deviations(NORMAL, STEP, misfit), alone)
    assert misfit.variance > 0


USUAL = Regularisation(3e-4, 0.0, OPTIONS)
# A row of places 1 cm apart; shape k moves place 3 k and a little of its neighbours.
PLACES = np.stack([0.01 * np.arange(15), 0.02 * np.cos(np.arange(15)), np.zeros(15)], axis=1)
SHAPES = np.zeros((5, 15, 3))
for shape in range(5):
    for place in range(15):
        SHAPES[shape, place, 1] = 0.01 * np.exp(-((place - 3 * shape) ** 2))


def world(bound: list[int], moving_head: bool = False, axes: int = 3) -> Confidence:
    return confidence_of(
        MotionModel.linear(PLACES, SHAPES, axes, moving_head), np.array(bound), STEP, USUAL
    )


def test_a_shape_that_no_marker_sees_keeps_its_prior_and_its_place_is_named() -> None:
    result = world([0, 3, 9, 12])
    assert result.remedies == {2: 6}
    assert result.deviations[2] == pytest.approx(OPTIONS.spread, rel=0.05)
    assert np.delete(result.deviations, 2).max() < 0.1
    assert result.places[0] == 6


def test_a_marker_at_the_named_place_shows_the_shape() -> None:
    result = world([0, 3, 9, 12, world([0, 3, 9, 12]).remedies[2]])
    assert not result.remedies and result.deviations.max() < 0.1


def test_no_place_is_named_where_one_marker_would_not_determine_the_shape() -> None:
    """Of three shapes that move alike a marker sees the sum."""
    alike = np.concatenate([SHAPES, SHAPES[[2, 2]]])
    result = confidence_of(
        MotionModel.linear(PLACES, alike, 3, False), np.array([0, 3, 9, 12]), STEP, USUAL
    )
    assert result.remedies == {2: None, 5: None, 6: None}


def test_places_are_the_best_of_all_one_at_a_time() -> None:
    bound: list[int] = [0, 3]
    for place in world(bound).places[:3].tolist():
        volumes = {}
        for tried in range(15):
            rows = SHAPES[:, [*bound, tried]].reshape(5, -1)
            precision = rows @ rows.T / 9e-8 + np.eye(5) / OPTIONS.spread**2
            volumes[tried] = -np.linalg.slogdet(precision)[1] if tried not in bound else np.inf
        assert place == min(volumes, key=volumes.__getitem__)
        bound.append(place)


def test_an_unknown_head_makes_weights_less_sure() -> None:
    every = list(range(15))
    assert (world(every, moving_head=True).deviations > world(every).deviations).all()


def test_an_image_sees_no_depth() -> None:
    deep = np.roll(SHAPES, 1, axis=2)
    bound = np.arange(0, 15, 3)
    result = confidence_of(MotionModel.linear(PLACES, deep, 2, False), bound, STEP, USUAL)
    np.testing.assert_allclose(result.deviations, OPTIONS.spread, rtol=1e-6)


def test_what_has_no_errors_is_sure() -> None:
    exact = Regularisation(0.0, 0.0, OPTIONS)
    result = confidence_of(MotionModel.linear(PLACES, SHAPES, 3, True), np.arange(15), STEP, exact)
    assert np.isfinite(result.deviations).all() and result.deviations.max() < 0.1
    assert not len(result.places)
