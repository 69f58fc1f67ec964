"""Solves with a normal matrix in each frame, by other programs and by theorems."""

import numpy as np
import pytest
from bands import dense
from scipy.optimize import LinearConstraint, minimize

from usdface.retarget.film.frame_normals import solve_by_frame
from usdface.retarget.solver import parallel_pieces
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.temporal_solve import solve_temporal

ROWS = Bounds(
    np.array([0.1, 0.0, -0.2]),
    np.array([0.9, 0.6, 0.8]),
    np.array([[1.0, -1.0, 0.0], [0.0, 1.0, 1.0]]),
    np.array([0.0, 0.8]),
)


def problem(seed: int, frames: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrices, right-hand sides and bands of three shapes."""
    random = np.random.default_rng(seed)
    slopes = random.normal(size=(frames, 3, 5))
    normals = slopes @ slopes.transpose(0, 2, 1) + 0.3 * np.eye(3)
    right = (normals @ random.uniform(-0.3, 1.3, (frames, 3, 1)))[..., 0]
    return normals, right, 1e-4 * curvature_bands(0.03 * np.arange(float(frames)))


def minimum(
    normals: np.ndarray, right: np.ndarray, bands: np.ndarray, bounds: Bounds
) -> np.ndarray:
    return solve_by_frame(normals, right, bands, bounds, None, 20_000, 1e-11).weights


@pytest.mark.filterwarnings("ignore:Values in x were outside bounds")  # old SciPy, of its own steps
@pytest.mark.parametrize("bounds", [Bounds(), ROWS])
def test_scipy_finds_the_same_minimum(bounds: Bounds) -> None:
    normals, right, bands = problem(2, 9)
    found = minimum(normals, right, bands, bounds)
    curvature = dense(bands)

    def objective(flat: np.ndarray) -> tuple[float, np.ndarray]:
        w = flat.reshape(right.shape)
        slope = (normals @ w[..., None])[..., 0] + curvature @ w
        return float((w * (0.5 * slope - right)).sum()), (slope - right).ravel()

    low, high = bounds.over(*right.shape)
    rows = (
        np.kron(np.eye(len(right)), bounds.rows) if len(bounds.rows) else np.zeros((0, right.size))
    )
    limits = bounds.limits_over(len(right)).ravel()
    judge = minimize(
        objective,
        np.full(right.size, 0.3),
        jac=True,
        method="SLSQP",
        bounds=list(zip(low.ravel(), high.ravel(), strict=True)),
        constraints=[LinearConstraint(rows, -np.inf, limits)] if len(rows) else [],
        options={"maxiter": 500, "ftol": 1e-14},
    )
    np.testing.assert_allclose(found.ravel(), judge.x, atol=1e-5)


@pytest.mark.parametrize("iterations", [3, 30])
def test_rows_are_kept_however_few_the_iterations(iterations: int) -> None:
    normals, right, bands = problem(2, 40)
    found = solve_by_frame(normals, right, bands, ROWS, None, iterations, 0.0).weights
    assert (found @ ROWS.rows.T - ROWS.limits).max() < 1e-9
    low, high = ROWS.over(*right.shape)
    assert (found - low).min() > -1e-12 and (high - found).min() > -1e-12


def test_frames_with_one_matrix_are_the_solve_with_one_matrix() -> None:
    normals, right, bands = problem(3, 30)
    normals[:] = normals[0]
    one = solve_temporal(normals[0], right, bands, Bounds(), None, 5000, 1e-12).weights
    np.testing.assert_allclose(minimum(normals, right, bands, Bounds()), one, atol=1e-9)


def test_without_smoothness_each_frame_is_its_own() -> None:
    normals, right, bands = problem(4, 20)
    wide = Bounds(np.array(-50.0), np.array(50.0))
    alone = np.linalg.solve(normals, right[..., None])[..., 0]
    np.testing.assert_allclose(minimum(normals, right, 0 * bands, wide), alone, atol=1e-8)


def test_pieces_of_a_take_are_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    normals, right, bands = problem(5, 400)
    whole = solve_by_frame(normals, right, bands, Bounds(), None, 60, 0.0).weights
    monkeypatch.setattr(parallel_pieces, "_PIECE", 50)
    monkeypatch.setattr(parallel_pieces, "_OVERLAPS", 1)
    pieces = solve_by_frame(normals, right, bands, Bounds(), None, 60, 0.0).weights
    np.testing.assert_allclose(pieces, whole, atol=1e-6)
