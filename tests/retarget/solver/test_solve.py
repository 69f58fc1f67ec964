import numpy as np
import pytest
from bands import dense
from scipy.linalg import solveh_banded
from scipy.optimize import minimize

from usdface.options import SolveOptions
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights

RNG = np.random.default_rng(6)
PLAIN = Regularisation(0.0, 0.0, SolveOptions())
EXACT = SolveOptions(tolerance=1e-9, iterations=20_000)


def small_take(noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    times = np.arange(40) / 30
    truth = np.clip(0.6 * np.sin(times[:, None] * [2.0, 3.0, 5.0]) + [0.2, 0.5, 0.1], 0, 1)
    offsets = RNG.normal(size=(3, 12))
    observed = truth @ offsets + noise * RNG.normal(size=(40, 12))
    return times, truth, offsets, observed


def test_without_noise_weights_come_back_exactly() -> None:
    times, truth, offsets, observed = small_take(0.0)
    solved = solve_weights(offsets @ offsets.T, observed @ offsets.T, times, PLAIN)
    np.testing.assert_allclose(solved.weights, truth, atol=1e-9)


def test_the_whole_take_solve_is_the_minimum_of_its_objective() -> None:
    noise = 0.3
    times, _, offsets, observed = small_take(noise)
    normal, right = offsets @ offsets.T, observed @ offsets.T
    w = solve_weights(normal, right, times, Regularisation(noise, 0.0, EXACT)).weights
    curvature = dense(curvature_bands(times)) * noise**2 / EXACT.agility
    ridge = noise**2 / EXACT.spread**2

    def objective(flat: np.ndarray) -> tuple[float, np.ndarray]:
        x = flat.reshape(w.shape)
        slope = x @ normal - right + ridge * x + curvature @ x
        return float(0.5 * np.sum(x * (slope - right))), slope.ravel()

    bounds = [(0, 1)] * w.size
    judge = minimize(
        objective, np.full(w.size, 0.5), jac=True, bounds=bounds, method="L-BFGS-B",
        options={"ftol": 1e-15, "gtol": 1e-10, "maxiter": 20_000, "maxfun": 50_000},
    )  # fmt: skip
    assert judge.fun == pytest.approx(objective(w.ravel())[0], rel=1e-9)
    np.testing.assert_allclose(w.ravel(), judge.x, atol=1e-4)


def test_away_from_the_bounds_it_is_a_linear_smoother() -> None:
    times = np.arange(60) / 60
    observed = 0.5 + 0.05 * RNG.normal(size=(60, 1))
    w = solve_weights(np.ones((1, 1)), observed, times, Regularisation(0.05, 0.0, EXACT)).weights
    bands = curvature_bands(times) * 0.05**2 / EXACT.agility
    bands[2] += 1.0 + 0.05**2 / EXACT.spread**2
    np.testing.assert_allclose(w, solveh_banded(bands, observed), atol=1e-6)


def test_weights_stay_in_the_box_and_smoothness_smooths() -> None:
    times, _, offsets, observed = small_take(1.0)
    normal, right = offsets @ offsets.T, observed @ offsets.T
    free, held = (Regularisation(1.0, 0.0, SolveOptions(smoothness=s)) for s in (0.0, 1.0))
    rough, smooth = (solve_weights(normal, right, times, r).weights for r in (free, held))
    for w in (rough, smooth):
        assert w.min() >= 0 and w.max() <= 1
    assert np.abs(np.diff(smooth, 2, axis=0)).mean() < np.abs(np.diff(rough, 2, axis=0)).mean()


def test_with_misfit_two_shapes_that_nearly_agree_share_instead_of_cancelling() -> None:
    """A twin that differs by a hair: without the ridge the misfit drives it to its bound."""
    rng = np.random.default_rng(13)
    shape, hair = rng.normal(size=40), 1e-3 * rng.normal(size=40)
    offsets = np.stack([shape, shape + hair])
    times = np.arange(5) / 60
    misfit = -0.5 * hair + 1e-2 * rng.normal(size=40)
    right = np.tile(0.4 * shape + misfit, (5, 1)) @ offsets.T
    normal = offsets @ offsets.T
    cancelling = solve_weights(normal, right, times, Regularisation(0.0, 0.0, EXACT)).weights
    sharing = solve_weights(normal, right, times, Regularisation(0.0, 1e-2, EXACT)).weights
    assert np.abs(cancelling[:, 0] - cancelling[:, 1]).min() > 0.35
    np.testing.assert_allclose(sharing, 0.2, atol=0.05)
