import numpy as np
import pytest
from scipy.optimize import lsq_linear

import usdface.retarget.box as box
from usdface.errors import SolveError
from usdface.retarget.box import solve_box


def problem(seed: int, frames: int, shapes: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    offsets = rng.normal(size=(rows, shapes)) * 10.0 ** rng.uniform(-2, 1, shapes)
    return offsets, rng.normal(size=(frames, rows)) * 3


@pytest.mark.parametrize("shapes", [1, 2, 7, 30])
def test_it_finds_scipys_minimum(shapes: int) -> None:
    offsets, observed = problem(shapes, 40, shapes, 3 * shapes)
    solved = solve_box(offsets.T @ offsets, observed @ offsets)
    judge = [lsq_linear(offsets, y, (0, 1), method="bvls", tol=1e-14).x for y in observed]
    np.testing.assert_allclose(solved, judge, atol=1e-9)


def test_known_weights_come_back() -> None:
    offsets, _ = problem(0, 1, 20, 60)
    truth = np.clip(np.random.default_rng(5).normal(0.5, 0.6, (100, 20)), 0, 1)
    solved = solve_box(offsets.T @ offsets, truth @ offsets.T @ offsets)
    np.testing.assert_allclose(solved, truth, atol=1e-8)


def test_no_weight_leaves_the_box_and_the_optimality_conditions_hold() -> None:
    offsets, observed = problem(9, 200, 15, 20)
    normal, right = offsets.T @ offsets, observed @ offsets
    w = solve_box(normal, right)
    gradient = w @ normal - right
    assert w.min() >= 0 and w.max() <= 1
    scale = np.abs(right).max()
    assert (gradient[w == 0] >= -1e-9 * scale).all()
    assert (gradient[w == 1] <= 1e-9 * scale).all()
    assert np.abs(gradient[(w > 0) & (w < 1)]).max() <= 1e-9 * scale


def test_a_frame_is_solved_the_same_alone_and_from_any_start() -> None:
    offsets, observed = problem(4, 30, 12, 18)
    normal, right = offsets.T @ offsets, observed @ offsets
    together = solve_box(normal, right)
    alone = np.concatenate([solve_box(normal, row[None]) for row in right])
    started = solve_box(normal, right, np.random.default_rng(1).uniform(-1, 2, right.shape))
    np.testing.assert_allclose(alone, together, atol=1e-12)
    np.testing.assert_allclose(started, together, atol=1e-9)


def test_batches_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    offsets, observed = problem(4, 30, 12, 18)
    whole = solve_box(offsets.T @ offsets, observed @ offsets)
    monkeypatch.setattr(box, "_BATCH_ELEMENTS", 500)
    batched = solve_box(offsets.T @ offsets, observed @ offsets)
    np.testing.assert_allclose(batched, whole, atol=1e-12)


def test_permuting_shapes_permutes_weights() -> None:
    offsets, observed = problem(8, 20, 10, 30)
    order = np.random.default_rng(3).permutation(10)
    solved = solve_box(offsets.T @ offsets, observed @ offsets)
    permuted = offsets[:, order]
    np.testing.assert_allclose(
        solve_box(permuted.T @ permuted, observed @ permuted), solved[:, order], atol=1e-9
    )


def test_a_shape_that_moves_nothing_is_refused_without_a_ridge() -> None:
    with pytest.raises(SolveError, match="singular"):
        solve_box(np.diag([1.0, 0.0]), np.ones((3, 2)))
