import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from bands import dense

from usdface.arrays import FloatArray
from usdface.options import SolveOptions
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.covariance import inverse_bands, inverse_spectrum, learn_covariance
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights

RNG = np.random.default_rng(8)
OPTIONS = SolveOptions()
STEP = 1 / 60
BASIS = 0.01 * RNG.normal(size=(5, 24))
# Two that move together, one that hardly moves, a large and a small one.
TRUE = np.diag([0.04, 0.04, 1e-6, 0.09, 0.01])
TRUE[0, 1] = TRUE[1, 0] = 0.038


def played(frames: int) -> FloatArray:
    """Weights (F, 5) drawn from the process itself, around the middle of their range."""
    over_time = np.linalg.cholesky(np.linalg.inv(dense(inverse_bands(times(frames), 8.0))))
    drawn = over_time @ RNG.normal(size=(frames, 5))
    return np.asarray(drawn @ np.linalg.cholesky(TRUE).T)


def times(frames: int) -> FloatArray:
    return STEP * np.arange(frames)


def learned(weights: FloatArray, noise: float) -> FloatArray:
    seen = weights @ BASIS + noise * RNG.normal(size=(len(weights), 24))
    normal, right = BASIS @ BASIS.T, seen @ BASIS.T
    start = solve_bounded(normal, right)
    moments = (normal, right, times(len(weights)), noise**2)
    return learn_covariance(*moments, OPTIONS.pace, start)


@pytest.mark.parametrize("noise", [1e-4, 3e-3])
def test_it_is_that_of_the_weights(noise: float) -> None:
    weights = played(1500)
    found, true = learned(weights, noise), weights.T @ weights / 1500
    sizes = np.sqrt(np.diag(found) / np.diag(true))
    np.testing.assert_allclose(sizes[[0, 1, 3, 4]], 1.0, atol=0.25)
    assert found[2, 2] < 0.05 * found[0, 0]
    assert found[0, 1] / np.sqrt(found[0, 0] * found[1, 1]) > 0.8
    assert (np.linalg.eigvalsh(found) > 0).all()


def test_the_process_has_the_variance_one_far_from_its_ends() -> None:
    spread = np.linalg.inv(dense(inverse_bands(times(400), 8.0)))
    assert spread[200, 200] == pytest.approx(1.0, rel=0.01)


def test_bands_and_spectrum_are_the_same_process() -> None:
    matrix = dense(inverse_bands(times(200), 8.0))
    wave = np.cos(0.3 * np.arange(200))
    share = inverse_spectrum(np.array([0.3]), STEP, 8.0)[0]
    np.testing.assert_allclose((matrix @ wave)[5:-5], (share * wave)[5:-5], rtol=1e-9, atol=1e-9)


def test_what_is_learned_gives_weights_back_better() -> None:
    weights, noise = np.clip(0.5 + played(900), 0.0, 1.0), 3e-3
    seen = weights @ BASIS + noise * RNG.normal(size=(900, 24))
    normal, right, when = BASIS @ BASIS.T, seen @ BASIS.T, times(900)
    fixed = Regularisation(noise, 0.0, OPTIONS)
    plain = solve_weights(normal, right, when, fixed).weights
    covariance = learn_covariance(normal, right, when, noise**2, OPTIONS.pace, plain)
    learned = replace(fixed, covariance=covariance)
    better = solve_weights(normal, right, when, learned).weights
    errors = [np.sqrt(np.mean((found - weights) ** 2)) for found in (plain, better)]
    assert errors[1] < 0.95 * errors[0]
    assert ((better >= 0.0) & (better <= 1.0)).all()


def test_the_unit_of_length_does_not_matter() -> None:
    weights = np.clip(0.5 + played(200), 0.0, 1.0)
    right = (weights @ BASIS + 1e-3 * RNG.normal(size=(200, 24))) @ BASIS.T
    normal, when = BASIS @ BASIS.T, times(200)
    metres = learn_covariance(normal, right, when, 1e-6, OPTIONS.pace, weights)
    scaled = (1e6 * normal, 1e6 * right, when, 1.0)
    np.testing.assert_allclose(learn_covariance(*scaled, OPTIONS.pace, weights), metres, rtol=1e-6)


def test_shapes_that_markers_do_not_tell_apart_take_no_products_of_their_own() -> None:
    """300 shapes on 24 coordinates: the sums over bins are of 24 directions, as is their time."""
    basis = 0.01 * RNG.normal(size=(300, 24))
    normal = basis @ basis.T
    weights = np.clip(0.1 * RNG.normal(size=(200, 300)), 0.0, 1.0)
    given = normal, weights @ normal, times(200), 1e-6, OPTIONS.pace, weights
    tracemalloc.start()
    try:
        found = learn_covariance(*given)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # The power of 15 bins, twice while it is gathered; with all directions it would be 66.
    assert peak < 40 * found.nbytes
