"""Exact box-constrained least squares for many right-hand sides at once.

Block principal pivoting (Portugal, Judice and Vicente 1994) with both bounds: guess which
unknowns sit on a bound, solve for the others, exchange all that disagree; when that stops
making progress in a problem, exchange its last disagreeing unknown only (Murty's rule), which
ends after finitely many steps for a positive definite matrix.
"""

import numpy as np

from usdface.errors import SolveError
from usdface.takes import BoolArray, FloatArray

__all__ = ["solve_box"]

_BATCH_ELEMENTS = 2_000_000
_PATIENCE = 5


def solve_box(normal: FloatArray, right: FloatArray, start: FloatArray | None = None) -> FloatArray:
    """Minimise ``w' N w / 2 - b' w`` over ``0 <= w <= 1`` for every row b of `right`.

    Parameters
    ----------
    normal : (S, S) float64
        Symmetric positive definite.
    right : (F, S) float64
    start : (F, S) float64, optional
        A guess; only which of its entries lie on a bound counts.

    Returns
    -------
    (F, S) float64
        The unique minimisers, in [0, 1].

    Raises
    ------
    SolveError
        If `normal` is not positive definite enough to solve with.
    """
    size = len(normal)
    diagonal = np.diag(normal)
    if not (diagonal > 0).all():
        raise SolveError("the solve's normal matrix is singular: a blend shape moves no marker")
    scale = 1.0 / np.sqrt(diagonal)
    # Unit diagonal: in the unknowns v = w / scale, with upper bound 1 / scale.
    unit = normal * scale * scale[:, None]
    upper = 1.0 / scale
    result = np.empty_like(right)
    batch = max(1, _BATCH_ELEMENTS // size**2)
    for first in range(0, len(right), batch):
        rows = slice(first, first + batch)
        guess = start[rows] if start is not None else None
        result[rows] = _pivot(unit, right[rows] * scale, upper, guess) * scale
    return np.clip(result, 0.0, 1.0)


def _pivot(
    unit: FloatArray, right: FloatArray, upper: FloatArray, start: FloatArray | None
) -> FloatArray:
    count, size = right.shape
    if start is None:
        start = np.linalg.solve(unit, right.T).T / upper
    at_zero, at_upper = start <= 0.0, start >= 1.0
    solution = np.zeros((count, size))
    tolerance = 1e-12 * (1.0 + np.abs(right).max(axis=1, initial=0.0, keepdims=True))
    best = np.full(count, size + 1)
    patience = np.full(count, _PATIENCE)
    open_rows = np.arange(count)
    for _ in range(100 * size):
        zero, full, rows_right = at_zero[open_rows], at_upper[open_rows], right[open_rows]
        values, gradient = _solve_free(unit, rows_right, upper, zero, full)
        bound = tolerance[open_rows]
        below = ~zero & ~full & (values < -bound)
        above = ~zero & ~full & (values > upper + bound)
        leave_zero = zero & (gradient < -bound)
        leave_upper = full & (gradient > bound)
        wrong = below | above | leave_zero | leave_upper
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
        at_zero[open_rows] = (zero & ~exchange) | (below & exchange)
        at_upper[open_rows] = (full & ~exchange) | (above & exchange)
        open_rows = open_rows[left]
    raise SolveError("the box-constrained solve did not settle; the rig's shapes are degenerate")


def _solve_free(
    unit: FloatArray, right: FloatArray, upper: FloatArray, zero: BoolArray, full: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Solve for the free unknowns of each row; return values and gradient, both (N, S)."""
    size = len(unit)
    fixed = np.where(full, upper, 0.0)
    free = ~(zero | full)
    masked = unit * free[:, None, :] * free[:, :, None]
    masked[:, np.arange(size), np.arange(size)] = 1.0
    reduced = np.where(free, right - fixed @ unit, fixed)
    values: FloatArray = np.linalg.solve(masked, reduced[..., None])[..., 0].astype(np.float64)
    return values, values @ unit - right
