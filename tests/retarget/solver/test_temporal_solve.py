import numpy as np
import pytest
from bands import dense
from scipy.optimize import LinearConstraint, minimize

from usdface.options import SolveOptions
from usdface.retarget.solver import parallel_pieces
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights
from usdface.retarget.solver.temporal_solve import Iterate, solve_temporal

NOISE = 0.3
USUAL = Regularisation(NOISE, 0.0, SolveOptions())


def take(seed: int, frames: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, and the normal matrix and right-hand sides of three shapes seen with noise."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.02, 0.05, frames))
    truth = np.clip(0.6 * np.sin(times[:, None] * [9.0, 6.0, 15.0]) + [0.4, 0.5, 0.1], 0, 1)
    offsets = rng.normal(size=(3, 12))
    observed = truth @ offsets + NOISE * rng.normal(size=(frames, 12))
    return times, offsets @ offsets.T, observed @ offsets.T


BOUNDS = Bounds(
    np.array([0.1, 0.0, -0.2]),
    np.concatenate([np.full((5, 3), 0.9), np.full((7, 3), 0.6)]),
    np.array([[1.0, -1.0, 0.0], [0.0, 1.0, 1.0]]),
    np.array([0.0, 0.8]),
)


@pytest.mark.filterwarnings("ignore:Values in x were outside bounds")  # old SciPy, of its own steps
@pytest.mark.parametrize("names", [(), ("smileLeft", "jawOpen", "smileRight")])
def test_scipy_finds_the_same_minimum_within_bounds_and_rows(names: tuple[str, ...]) -> None:
    times, normal, right = take(1)
    options = SolveOptions(
        iterations=20_000, tolerance=1e-10, smoothness=2.0, sparsity=0.7, symmetry=30.0
    )
    regularisation = Regularisation(NOISE, 0.1, options, names)
    w = solve_weights(normal, right, times, regularisation, bounds=BOUNDS).weights
    error = regularisation.variance
    curvature = dense(curvature_bands(times)) * NOISE**2 * 2.0 / options.agility

    def objective(flat: np.ndarray) -> tuple[float, np.ndarray]:
        x = flat.reshape(w.shape)
        slope = x @ normal + error / options.spread**2 * x + curvature @ x
        slope[:, 0] += (error * 30.0 * (x[:, 0] - x[:, 2])) if names else 0.0
        slope[:, 2] -= (error * 30.0 * (x[:, 0] - x[:, 2])) if names else 0.0
        value = 0.5 * np.sum(x * slope) - np.sum(x * right) + error * 0.7 * x.sum()
        return float(value), (slope - right + error * 0.7).ravel()

    low, high = BOUNDS.over(*w.shape)
    rows = np.kron(np.eye(len(w)), BOUNDS.rows)
    judge = minimize(
        objective,
        np.full(w.size, 0.3),
        jac=True,
        method="SLSQP",
        bounds=list(zip(low.ravel(), high.ravel(), strict=True)),
        constraints=LinearConstraint(rows, -np.inf, BOUNDS.limits_over(len(w)).ravel()),
        options={"ftol": 1e-13, "maxiter": 2000},
    )
    assert objective(w.ravel())[0] == pytest.approx(judge.fun, rel=1e-8)
    np.testing.assert_allclose(w.ravel(), judge.x, atol=2e-5)
    assert (w @ BOUNDS.rows.T <= BOUNDS.limits + 1e-9).all()
    assert (w @ BOUNDS.rows.T > BOUNDS.limits - 1e-6).mean() > 0.2, "the rows must matter"


def test_a_pin_is_met_exactly_and_its_neighbours_bend_towards_it() -> None:
    times, normal, right = take(2, 40)
    lower, upper = np.zeros((40, 3)), np.ones((40, 3))
    lower[20, 1] = upper[20, 1] = 0.987
    free = solve_weights(normal, right, times, USUAL).weights
    held = solve_weights(normal, right, times, USUAL, bounds=Bounds(lower, upper)).weights
    assert held[20, 1] == 0.987
    moved = (held - free)[:, 1]
    assert abs(moved[20]) > 0.2, "the pin must matter"
    near = moved[[19, 21]] / moved[20]
    assert (near > 0.5).all() and (near < 1.0).all()
    assert np.abs(moved[[0, -1]]).max() < 0.02 * abs(moved[20])


def test_even_a_rough_solve_keeps_bounds_and_rows() -> None:
    times, normal, right = take(3, 30)
    bounds = Bounds(rows=np.array([[1.0, -1.0, 0.0]]))
    bands = curvature_bands(times) * NOISE**2 / 27.0
    start = Iterate(np.full((30, 3), [1.0, 0.0, 0.5]))
    w = solve_temporal(normal, right, bands, bounds, start, 2, 0.0).weights
    assert w.min() >= 0.0 and w.max() <= 1.0 and (w[:, 0] <= w[:, 1] + 1e-9).all()


def test_frame_mode_is_the_exact_solve_of_each_frame() -> None:
    times, normal, right = take(4, 20)
    each = Regularisation(NOISE, 0.0, SolveOptions(mode="frame"))
    whole = solve_weights(normal, right, times, each).weights
    for t in (0, 7, 19):
        alone = solve_weights(normal, right[[t]], times[[t]], each).weights
        np.testing.assert_allclose(whole[[t]], alone, atol=1e-12)
    smooth = solve_weights(normal, right, times, USUAL).weights
    assert np.abs(np.diff(whole, 2, axis=0)).mean() > 2 * np.abs(np.diff(smooth, 2, axis=0)).mean()


def test_sparsity_silences_the_weak_and_symmetry_levels_the_sides() -> None:
    """A world that can be solved by hand: two shapes, each seen by markers of its own."""
    right, times = np.array([[0.2, 0.6]]), np.zeros(1)
    noise, spread = 0.1, 1e6
    sparse = SolveOptions(spread=spread, sparsity=30.0)
    w = solve_weights(np.eye(2), right, times, Regularisation(noise, 0.0, sparse)).weights
    np.testing.assert_allclose(w, [[0.0, 0.3]], atol=1e-9)
    level = SolveOptions(spread=spread, symmetry=50.0)
    paired = Regularisation(noise, 0.0, level, ("smileLeft", "smileRight"))
    w = solve_weights(np.eye(2), right, times, paired).weights
    # The mean stays, the difference is divided by 1 + 2 * 50 * 0.1^2.
    np.testing.assert_allclose(w, [[0.4 - 0.1, 0.4 + 0.1]], atol=1e-9)


def long_take() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights that run against their bounds all the time, on an evenly sampled take."""
    rng = np.random.default_rng(8)
    times = np.arange(1200) / 60
    truth = np.clip(np.sin(times[:, None] * [1.0, 2.3, 0.7, 3.1]) + 0.4, 0, 1)
    offsets = rng.normal(size=(4, 9)) * [[1.0], [0.3], [1.0], [0.05]]
    observed = truth @ offsets + 0.2 * rng.normal(size=(1200, 9))
    return times, offsets @ offsets.T, observed @ offsets.T


@pytest.mark.parametrize("iterations", [12, 100])
def test_a_take_in_pieces_has_no_seams(monkeypatch: pytest.MonkeyPatch, iterations: int) -> None:
    times, normal, right = long_take()
    pins = np.full((1200, 4), 1.0), np.full((1200, 4), 0.0)
    pins[1][::7, 0] = pins[0][::7, 0] = 0.3
    bounds = Bounds(pins[1], pins[0], np.array([[0.0, 1.0, -1.0, 0.0]]))
    few = Regularisation(0.2, 0.0, SolveOptions(iterations=iterations))

    def solve(piece: int, overlap_share: float = 1.0) -> np.ndarray:
        monkeypatch.setattr(parallel_pieces, "_PIECE", piece)
        monkeypatch.setattr(parallel_pieces, "_OVERLAPS", 0)
        monkeypatch.setattr(
            parallel_pieces, "overlap", lambda *given: int(overlap_share * overlap(*given))
        )
        return solve_weights(normal, right, times, few, bounds=bounds).weights

    overlap = parallel_pieces.overlap
    whole = solve(10**9)
    assert np.abs(solve(150) - whole).max() < 1e-6
    assert np.abs(solve(150, 0.05) - whole).max() > 1e-6, "the overlap must matter"
