import numpy as np
import pytest
from scipy.optimize import lsq_linear

from usdface.errors import SolveError
from usdface.retarget.solver import bounded_least_squares as box
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.bounds import Bounds


def problem(seed: int, frames: int, shapes: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    offsets = rng.normal(size=(rows, shapes)) * 10.0 ** rng.uniform(-2, 1, shapes)
    return offsets, rng.normal(size=(frames, rows)) * 3


@pytest.mark.parametrize("shapes", [1, 2, 7, 30])
def test_it_finds_scipys_minimum(shapes: int) -> None:
    offsets, observed = problem(shapes, 40, shapes, 3 * shapes)
    solved = solve_bounded(offsets.T @ offsets, observed @ offsets)
    judge = [lsq_linear(offsets, y, (0, 1), method="bvls", tol=1e-14).x for y in observed]
    np.testing.assert_allclose(solved, judge, atol=1e-9)


def test_known_weights_come_back() -> None:
    offsets, _ = problem(0, 1, 20, 60)
    truth = np.clip(np.random.default_rng(5).normal(0.5, 0.6, (100, 20)), 0, 1)
    solved = solve_bounded(offsets.T @ offsets, truth @ offsets.T @ offsets)
    np.testing.assert_allclose(solved, truth, atol=1e-8)


def test_no_weight_leaves_the_box_and_the_optimality_conditions_hold() -> None:
    offsets, observed = problem(9, 200, 15, 20)
    normal, right = offsets.T @ offsets, observed @ offsets
    w = solve_bounded(normal, right)
    gradient = w @ normal - right
    assert w.min() >= 0 and w.max() <= 1
    scale = np.abs(right).max()
    assert (gradient[w == 0] >= -1e-9 * scale).all()
    assert (gradient[w == 1] <= 1e-9 * scale).all()
    assert np.abs(gradient[(w > 0) & (w < 1)]).max() <= 1e-9 * scale


def test_a_frame_is_solved_the_same_alone_and_from_any_start() -> None:
    offsets, observed = problem(4, 30, 12, 18)
    normal, right = offsets.T @ offsets, observed @ offsets
    together = solve_bounded(normal, right)
    alone = np.concatenate([solve_bounded(normal, row[None]) for row in right])
    started = solve_bounded(normal, right, np.random.default_rng(1).uniform(-1, 2, right.shape))
    np.testing.assert_allclose(alone, together, atol=1e-12)
    np.testing.assert_allclose(started, together, atol=1e-9)


def test_batches_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    offsets, observed = problem(4, 30, 12, 18)
    whole = solve_bounded(offsets.T @ offsets, observed @ offsets)
    monkeypatch.setattr(box, "_BATCH_ELEMENTS", 500)
    batched = solve_bounded(offsets.T @ offsets, observed @ offsets)
    np.testing.assert_allclose(batched, whole, atol=1e-12)


def test_permuting_shapes_permutes_weights() -> None:
    offsets, observed = problem(8, 20, 10, 30)
    order = np.random.default_rng(3).permutation(10)
    solved = solve_bounded(offsets.T @ offsets, observed @ offsets)
    permuted = offsets[:, order]
    np.testing.assert_allclose(
        solve_bounded(permuted.T @ permuted, observed @ permuted), solved[:, order], atol=1e-9
    )


def test_a_shape_that_moves_nothing_is_refused_without_a_ridge() -> None:
    with pytest.raises(SolveError, match="singular"):
        solve_bounded(np.diag([1.0, 0.0]), np.ones((3, 2)))


def constrained(seed: int, frames: int = 60) -> tuple[np.ndarray, np.ndarray, Bounds]:
    """A problem with bounds of its own in each frame, pins, and three rows."""
    rng = np.random.default_rng(seed)
    offsets, observed = problem(seed, frames, 9, 12)
    lower = rng.uniform(-0.5, 0.2, (frames, 9))
    upper = lower + rng.uniform(0.2, 1.5, (frames, 9))
    pinned = rng.random((frames, 9)) < 0.1
    upper[pinned] = lower[pinned]
    rows = np.zeros((3, 9))
    rows[0, [0, 1]] = 1.0, -1.0
    rows[1, [2, 3, 4]] = 1.0, 1.0, 1.0
    rows[2, [5, 1]] = 2.0, -0.5
    # Each frame has a point that keeps the rows, with nothing to spare in some.
    inside = lower + rng.uniform(0.3, 0.7, lower.shape) * (upper - lower)
    limits = inside @ rows.T + np.maximum(rng.uniform(-0.2, 0.5, (frames, 3)), 0.0)
    return offsets.T @ offsets, observed @ offsets, Bounds(lower, upper, rows, limits)


def kkt_error(
    w: np.ndarray, normal: np.ndarray, right: np.ndarray, bounds: Bounds
) -> tuple[float, float]:
    """How far w is outside its bounds and rows, and how far from having a multiplier for them.

    The multipliers of the active bounds and rows are found by non-negative least squares.
    """
    low, high = bounds.over(*w.shape)
    limits = bounds.limits_over(len(w))
    outside = max((low - w).max(), (w - high).max(), (w @ bounds.rows.T - limits).max())
    scale = 1.0 / np.sqrt(np.diag(normal))
    worst = 0.0
    for t in range(len(w)):
        eye = np.eye(w.shape[1])
        active = [-eye[w[t] <= low[t]], eye[w[t] >= high[t]]]
        active.append(bounds.rows[bounds.rows @ w[t] >= limits[t] - 1e-9])
        columns = (np.vstack(active) * scale).T
        gradient = (normal @ w[t] - right[t]) * scale
        # Not nnls, which fails on a singular matrix in SciPy 1.12.
        found = lsq_linear(columns, -gradient, (0, np.inf), "bvls").x if columns.size else ()
        error = np.linalg.norm(columns @ found + gradient)
        worst = max(worst, error / (1.0 + np.abs(right[t] * scale).max()))
    return float(outside), worst


@pytest.mark.parametrize("seed", range(4))
def test_bounds_pins_and_inequalities_hold_and_are_optimal(seed: int) -> None:
    normal, right, bounds = constrained(seed)
    w = solve_bounded(normal, right, bounds=bounds)
    outside, multipliers = kkt_error(w, normal, right, bounds)
    assert outside < 1e-9 and multipliers < 1e-9
    low, high = bounds.over(*w.shape)
    assert ((w >= low) & (w <= high)).all()
    assert (w[low == high] == low[low == high]).all()
    assert (w @ bounds.rows.T > bounds.limits - 1e-9).mean() > 0.1, "the rows must matter"


def test_rows_that_do_not_matter_change_nothing() -> None:
    normal, right, bounds = constrained(7)
    free = Bounds(bounds.lower, bounds.upper)
    loose = Bounds(bounds.lower, bounds.upper, bounds.rows, np.full(3, 100.0))
    np.testing.assert_allclose(
        solve_bounded(normal, right, bounds=loose),
        solve_bounded(normal, right, bounds=free),
        atol=1e-12,
    )


def test_where_pins_leave_a_row_no_room_the_pins_win() -> None:
    pins = np.array([0.8, 0.2, 0.0])
    bounds = Bounds(pins, np.array([0.8, 0.2, 1.0]), np.array([[1.0, -1.0, 0.0]]))
    w = solve_bounded(np.eye(3), np.array([[0.0, 0.0, 0.6]]), bounds=bounds)
    np.testing.assert_allclose(w, [[0.8, 0.2, 0.6]], atol=1e-12)


def test_a_row_may_be_said_twice() -> None:
    normal, right, bounds = constrained(3)
    twice = Bounds(
        bounds.lower, bounds.upper, np.repeat(bounds.rows, 2, 0), np.repeat(bounds.limits, 2, 1)
    )
    np.testing.assert_allclose(
        solve_bounded(normal, right, bounds=twice),
        solve_bounded(normal, right, bounds=bounds),
        atol=1e-9,
    )
