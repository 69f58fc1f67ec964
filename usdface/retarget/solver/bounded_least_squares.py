"""Exact box-constrained least squares for many right-hand sides at once.

Block principal pivoting (Portugal, Judice and Vicente 1994) with both bounds: guess which
unknowns sit on a bound, solve for the others, exchange all that disagree; when that stops
making progress in a problem, exchange its last disagreeing unknown only (Murty's rule), which
ends after finitely many steps for a positive definite matrix.

Inequalities join as more unknowns: their multipliers, which are 0 or more. The matrix is no longer
symmetric but stays positive definite with a small slack for each multiplier, which a few proximal
steps (Rockafellar 1976) remove.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import SolveError
from usdface.retarget.solver.backend import kernels, on_all_cores
from usdface.retarget.solver.bounds import UNIT, Bounds

__all__ = ["solve_bounded"]

# Bounds on memory: numbers in the matrices of a batch (16 MB); frames of a compiled batch.
_BATCH_ELEMENTS = 2_000_000
_BATCH = 512
# Exchanges of all without progress before those of one; affects the time only. Set by hand.
_PATIENCE = 5
# Slack of a row of unit size for a multiplier of 1, and the violation to which it is reduced, as
# long as each step halves it: an infeasible row stays violated.
_GIVE = 1e-8
_KEPT = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class _Problem:
    """``F(z) = z M - q`` is 0, or z rests on a bound with F pointing outwards.

    The first `size` of the unknowns are weights divided by `scale`, the others multipliers.
    """

    matrix: FloatArray
    lower: FloatArray
    upper: FloatArray
    right: FloatArray


_Pivot = Callable[[_Problem, FloatArray | None], FloatArray]


def solve_bounded(
    normal: FloatArray,
    right: FloatArray,
    start: FloatArray | None = None,
    bounds: Bounds = UNIT,
) -> FloatArray:
    """Minimise ``w' N w / 2 - b' w`` within `bounds` for every row b of `right`.

    Parameters
    ----------
    normal : (S, S) float64
        Symmetric positive definite.
    right : (F, S) float64
    start : (F, S) float64, optional
        A guess; only its active set is used.
    bounds : Bounds, optional
        0 to 1, if left out.

    Returns
    -------
    (F, S) float64
        The unique minimisers, never outside the lower and upper bounds. A row that is infeasible
        within these is violated.

    Raises
    ------
    SolveError
        If `normal` is not positive definite enough to solve with.
    """
    size = len(normal)
    if not (np.diag(normal) > 0).all():
        raise SolveError(
            "the solve's normal matrix is singular: a blend shape moves no marker; bind a marker "
            "that it moves"
        )
    scale, matrix, row_scale = _scaled(normal, bounds.rows)
    lower, upper = bounds.over(*right.shape)
    limits = bounds.limits_over(len(right))
    result = np.empty(right.shape)
    compiled = kernels(len(right), len(matrix))
    pivot = partial(_pivot_compiled, compiled) if compiled else _pivot

    def solve(frames: slice) -> None:
        low, high = lower[frames], upper[frames]
        rows = np.zeros((len(low), len(row_scale)))
        problem = _Problem(
            matrix,
            np.hstack([low / scale, rows]),
            np.hstack([high / scale, rows + np.inf]),
            np.hstack([right[frames] * scale, -limits[frames] * row_scale]),
        )
        guess = None if start is None else np.hstack([start[frames] / scale, rows])
        solution = pivot(problem, guess)
        if len(row_scale):
            solution = _kept_rows(pivot, problem, solution, size)
        # A weight on its bound equals it exactly, despite scaling.
        on_low = solution[:, :size] <= problem.lower[:, :size]
        on_high = solution[:, :size] >= problem.upper[:, :size]
        weights = np.clip(solution[:, :size] * scale, low, high)
        result[frames] = np.where(on_low, low, np.where(on_high, high, weights))

    batch = _BATCH if compiled else max(1, _BATCH_ELEMENTS // len(matrix) ** 2)
    on_all_cores(solve, [slice(i, i + batch) for i in range(0, len(right), batch)])
    return result


def _scaled(normal: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the scale of the weights, the matrix of the unknowns, and the scale of the rows.

    In the unknowns v = w / scale the diagonal is 1; a row's size is its length in the
    metric of the inverse of the normal matrix.
    """
    scale = 1.0 / np.sqrt(np.diag(normal))
    unit = normal * scale * scale[:, None]
    if not len(rows):
        return scale, unit, np.zeros(0)
    scaled = rows * scale
    worth = np.einsum("cs,sc->c", scaled, np.linalg.solve(unit, scaled.T))
    row_scale = 1.0 / np.sqrt(np.maximum(worth, 1e-300))
    scaled *= row_scale[:, None]
    # Transposed: unknowns are rows, from the left.
    matrix = np.block([[unit, -scaled.T], [scaled, _GIVE * np.eye(len(rows))]])
    return scale, matrix, row_scale


def _kept_rows(pivot: _Pivot, problem: _Problem, solution: FloatArray, size: int) -> FloatArray:
    """Solve again where a row is violated, with slack for the change of its multiplier only."""
    result = solution.copy()
    broken = np.arange(len(solution))
    before = np.full(len(solution), np.inf)
    while len(broken):
        here = result[broken]
        excess = problem.right[broken, size:] - here[:, :size] @ problem.matrix[:size, size:]
        worst = excess.max(axis=1)
        again = (worst > _KEPT) & (worst < 0.5 * before)
        broken, before, here = broken[again], worst[again], here[again]
        right = problem.right[broken].copy()
        right[:, size:] += _GIVE * here[:, size:]
        easier = _Problem(problem.matrix, problem.lower[broken], problem.upper[broken], right)
        result[broken] = pivot(easier, here)
    return result


def _pivot_compiled(compiled: Any, problem: _Problem, guess: FloatArray | None) -> FloatArray:
    """Do as `_pivot` does, but each frame from where the one before ended."""
    count, size = problem.right.shape
    # Padded with unknowns pinned to 0 to a multiple of eight: whole SIMD vectors.
    padding = -size % 8
    matrix = np.eye(size + padding)
    matrix[:size, :size] = problem.matrix
    filled = [
        np.pad(part, ((0, 0), (0, padding)))
        for part in (problem.lower, problem.upper, problem.right)
    ]
    padded, settled = np.zeros((count, size + padding)), np.zeros(count, np.bool_)
    compiled.pivot(matrix, *filled, padded, settled)
    solution = padded[:, :size]
    if not settled.all():
        left = ~settled
        part = _Problem(
            problem.matrix, problem.lower[left], problem.upper[left], problem.right[left]
        )
        solution[left] = _pivot(part, guess[left] if guess is not None else None)
    return solution


def _pivot(problem: _Problem, guess: FloatArray | None) -> FloatArray:
    matrix, lower, upper, right = problem.matrix, problem.lower, problem.upper, problem.right
    count, size = right.shape
    if guess is None:
        guess = np.asarray(np.linalg.solve(matrix.T, right.T).T)
    pinned = lower == upper
    at_lower = pinned | (guess <= lower)
    at_upper = (guess >= upper) & ~at_lower
    solution = np.zeros((count, size))
    tolerance = 1e-12 * (1.0 + np.abs(right).max(axis=1, initial=0.0, keepdims=True))
    best = np.full(count, size + 1)
    patience = np.full(count, _PATIENCE)
    open_rows = np.arange(count)
    for _ in range(100 * size):
        low, high, bound = lower[open_rows], upper[open_rows], tolerance[open_rows]
        on_low, on_high = at_lower[open_rows], at_upper[open_rows]
        fixed = np.where(on_high, high, np.where(on_low, low, 0.0))
        free = ~(on_low | on_high)
        values, gradient = _solve_free(matrix, right[open_rows], fixed, free)
        below = free & (values < low - bound)
        above = free & (values > high + bound)
        leave = (on_low & (gradient < -bound)) | (on_high & (gradient > bound))
        wrong = below | above | (leave & ~pinned[open_rows])
        disagreeing = wrong.sum(axis=1)
        solution[open_rows] = values
        left = disagreeing > 0
        if not left.any():
            return solution
        progress = disagreeing < best[open_rows]
        best[open_rows] = np.minimum(best[open_rows], disagreeing)
        patience[open_rows] = np.where(progress, _PATIENCE, patience[open_rows] - 1)
        single = patience[open_rows] < 0
        last = size - 1 - np.argmax(wrong[:, ::-1], axis=1)
        exchange = wrong & (~single[:, None] | (np.arange(size) == last[:, None]))
        at_lower[open_rows] = (on_low & ~exchange) | (below & exchange)
        at_upper[open_rows] = (on_high & ~exchange) | (above & exchange)
        open_rows = open_rows[left]
    raise SolveError("the box-constrained solve did not settle; the rig's shapes are degenerate")


def _solve_free(
    matrix: FloatArray, right: FloatArray, fixed: FloatArray, free: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Solve for the free unknowns of each row; return values and gradient, both (N, S)."""
    size = len(matrix)
    # Unknowns are rows: the systems to solve are those of the transpose.
    masked = matrix.T * free[:, None, :] * free[:, :, None]
    masked[:, np.arange(size), np.arange(size)] += ~free
    reduced = np.where(free, right - fixed @ matrix, fixed)
    values: FloatArray = np.linalg.solve(masked, reduced[..., None])[..., 0].astype(np.float64)
    return values, values @ matrix - right
