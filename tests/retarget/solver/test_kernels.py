"""The compiled loops against those in numpy, which the other tests judge."""

import os
from pathlib import Path

import numpy as np
import pytest

import usdface

pytest.importorskip("numba", reason="numba is not installed")

from usdface.retarget.solver import bounded_least_squares, temporal_solve
from usdface.retarget.solver import kernels as compiled
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.bounds import UNIT, Bounds
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.temporal_solve import Iterate, solve_temporal


def both_ways(monkeypatch: pytest.MonkeyPatch, solve):
    """Solve in numpy, then compiled."""
    monkeypatch.setattr(bounded_least_squares, "kernels", lambda *_: None)
    monkeypatch.setattr(temporal_solve, "kernels", lambda *_: None)
    plain = solve()
    monkeypatch.setattr(bounded_least_squares, "kernels", lambda *_: compiled)
    monkeypatch.setattr(temporal_solve, "kernels", lambda *_: compiled)
    return plain, solve()


def face(seed: int, shapes: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a badly scaled normal matrix, and right-hand sides of weights that move slowly."""
    rng = np.random.default_rng(seed)
    offsets = rng.normal(size=(shapes, 2 * shapes)) * 10.0 ** rng.uniform(-2, 0, (shapes, 1))
    phase, speed = rng.uniform(0, 6, shapes), rng.uniform(0.02, 0.2, shapes)
    truth = np.clip(0.4 + np.sin(phase + speed * np.arange(frames)[:, None]), 0, 1)
    observed = truth @ offsets + 0.1 * rng.normal(size=(frames, 2 * shapes))
    return offsets @ offsets.T + 1e-3 * np.eye(shapes), observed @ offsets.T


def bounds_of(seed: int, shapes: int, frames: int) -> Bounds:
    rng = np.random.default_rng(seed)
    lower = rng.uniform(-0.2, 0.2, (frames, shapes))
    upper = lower + rng.uniform(0.2, 1.0, (frames, shapes))
    pins = rng.random((frames, shapes)) < 0.05
    upper[pins] = lower[pins]
    rows = np.zeros((3, shapes))
    rows[[0, 0, 1, 1, 2], [0, 1, 2, 3, 4]] = 1.0, -1.0, 1.0, 1.0, 1.0
    return Bounds(lower, upper, rows, lower @ rows.T + rng.uniform(0.0, 0.3, (frames, 3)))


@pytest.mark.parametrize("shapes", [1, 6, 23])
@pytest.mark.parametrize("bounded", [False, True])
def test_the_exact_solve_is_the_same(
    monkeypatch: pytest.MonkeyPatch, shapes: int, bounded: bool
) -> None:
    frames = 700  # more than one batch
    normal, right = face(shapes, shapes, frames)
    bounds = bounds_of(1, shapes, frames) if bounded and shapes > 4 else UNIT
    plain, fused = both_ways(monkeypatch, lambda: solve_bounded(normal, right, bounds=bounds))
    np.testing.assert_allclose(fused, plain, rtol=0, atol=1e-9)
    low, high = bounds.over(*plain.shape)
    np.testing.assert_array_equal(fused == low, plain == low)
    np.testing.assert_array_equal(fused == high, plain == high)


def test_a_long_random_walk_of_the_tableau_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames without any relation: the tableau is exchanged thousands of times."""
    normal, right = face(5, 12, 500)
    shuffled = right[np.random.default_rng(0).permutation(500)] * np.linspace(-3, 3, 12)
    plain, fused = both_ways(monkeypatch, lambda: solve_bounded(normal, shuffled))
    np.testing.assert_allclose(fused, plain, rtol=0, atol=1e-9)


def test_rows_that_the_tableau_cannot_settle_go_to_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    normal, right = face(2, 6, 40)
    plain, _ = both_ways(monkeypatch, lambda: solve_bounded(normal, right))

    class Lazy:
        @staticmethod
        def pivot(*arguments: np.ndarray) -> None:
            compiled.pivot(*arguments)
            solution, settled = arguments[-2:]
            solution[::3], settled[::3] = np.nan, False

    monkeypatch.setattr(bounded_least_squares, "kernels", lambda *_: Lazy)
    np.testing.assert_allclose(solve_bounded(normal, right), plain, rtol=0, atol=1e-9)


@pytest.mark.parametrize("frames", [1, 2, 3, 9, 150])
@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("bounded", [False, True])
def test_the_whole_take_is_the_same(
    monkeypatch: pytest.MonkeyPatch, frames: int, even: bool, bounded: bool
) -> None:
    normal, right = face(3, 7, frames)
    steps = np.full(frames, 1 / 30) if even else np.random.default_rng(1).uniform(0.01, 0.1, frames)
    bands = curvature_bands(np.cumsum(steps)) * 1e-4
    bounds = bounds_of(2, 7, frames) if bounded else UNIT
    rng = np.random.default_rng(4)
    wide = 7 + len(bounds.rows)
    start = Iterate(rng.uniform(0, 1, (frames, 7)), rng.normal(size=(frames, wide)))
    for begin in (None, start):
        plain, fused = both_ways(
            monkeypatch,
            lambda begin=begin: solve_temporal(normal, right, bands, bounds, begin, 30, 1e-12),
        )
        np.testing.assert_allclose(fused.weights, plain.weights, rtol=0, atol=1e-9)
        np.testing.assert_allclose(fused.dual, plain.dual, rtol=0, atol=1e-9)


def test_both_stop_at_the_same_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    normal, right = face(3, 5, 60)
    bands = curvature_bands(np.arange(60) / 30) * 1e-4
    plain, fused = both_ways(
        monkeypatch, lambda: solve_temporal(normal, right, bands, UNIT, None, 500, 1e-4)
    )
    np.testing.assert_allclose(fused.weights, plain.weights, rtol=0, atol=1e-9)


def test_the_factor_of_an_even_take_is_short_and_that_of_an_uneven_one_whole() -> None:
    values = np.array([0.5, 1.0, 2.0, 40.0])
    even, rows = compiled.factorise(curvature_bands(np.arange(5000) / 60) * 1e-6, values)
    assert len(even) < 200 and len(rows) == 5000 and rows.max() == len(even) - 1
    times = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.05, 300))
    uneven, rows = compiled.factorise(curvature_bands(times) * 1e-6, values)
    assert len(uneven) == 300 and (rows == np.arange(300)).all()


def test_machine_code_is_kept_outside_the_package_and_numba_as_it_was() -> None:
    """Inside, it would outlive an uninstall by pip and hide an editable install."""
    package = Path(usdface.__file__).parent
    kept = Path(compiled.pivot.stats.cache_path)
    assert kept.is_dir() and not kept.is_relative_to(package)
    assert os.environ.get("NUMBA_CACHE_DIR", "") == pytest.importorskip("numba").config.CACHE_DIR
