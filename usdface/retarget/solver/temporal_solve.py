"""Weights of all frames at once, smooth in time: ADMM with one eigen-decomposition.

The alternating direction method of multipliers (Boyd et al. 2011) with over-relaxation: the
unconstrained step becomes S independent pentadiagonal systems in time, the other step clips
weights to their bounds and rows of weights to their limits.

Long takes are solved in pieces, side by side on all cores
(`usdface.retarget.solver.parallel_pieces`).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpbtrs

from usdface.arrays import FloatArray
from usdface.retarget.solver.backend import kernels, on_all_cores
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.parallel_pieces import overlap, pieces
from usdface.retarget.solver.shared_system import SharedSystem, joined_limits, shared_system

__all__ = [
    "RELAXATION",
    "Iterate",
    "obeying",
    "solve_temporal",
    "temporal_reach",
]

# Over-relaxation: 1.5 to 1.8 is advised (Boyd et al. 2011, section 3.4.3).
RELAXATION = 1.8
# Allowed error of weights where pieces of a take are solved separately.
_NOTHING = 1e-10


@dataclass(frozen=True, eq=False, slots=True)
class Iterate:
    """An iterate of the solve: `weights` (F, S) within their bounds, and ADMM's scaled `dual`.

    The dual is (F, S + C), with C the inequality rows.
    """

    weights: FloatArray
    dual: FloatArray | None = None


@dataclass(frozen=True, eq=False, slots=True)
class _PieceEquations:
    """The parts of the equations that differ from frame to frame, for some frames.

    Attributes
    ----------
    right : (F, S) float64
    bands : (3, F) float64
        As of `solve_temporal`.
    low, high : (F, S + C) float64
        Limits of the clipped unknowns.
    """

    right: FloatArray
    bands: FloatArray
    low: FloatArray
    high: FloatArray


def solve_temporal(
    normal: FloatArray,
    right: FloatArray,
    bands: FloatArray,
    bounds: Bounds,
    start: Iterate | None,
    iterations: int,
    tolerance: float,
    covariance: FloatArray | None = None,
) -> Iterate:
    """Minimise ``sum_t (w_t' N w_t / 2 - b_t' w_t) + tr(M^-1 W' K W) / 2`` within `bounds`.

    Parameters
    ----------
    normal : (S, S) float64
        N, symmetric positive definite.
    right : (F, S) float64
        b of every frame.
    bands : (3, F) float64
        K, as `usdface.retarget.solver.curvature.curvature_bands` gives it, in units of `normal`.
    bounds : Bounds
    start : Iterate, optional
        Else each frame starts at its own unbounded minimum.
    iterations : int
        Upper bound.
    tolerance : float [1]
        No iteration is done after one that changes no weight by more.
    covariance : (S, S) float64, optional
        M, of the weights in a frame, positive definite; the unit matrix, if left out.
    """
    system = shared_system(normal, bands, bounds.rows, covariance)
    frames, size = right.shape
    compiled = kernels(frames, size)
    alternate = partial(_alternate_compiled, compiled) if compiled else _alternate
    dual = np.zeros((frames, len(system.joined)))
    result = Iterate(np.empty(right.shape), dual)

    def solve(piece: tuple[slice, slice]) -> None:
        core, whole = piece
        there = bounds.at(whole)
        weights = start.weights[whole] if start else np.linalg.solve(normal, right[whole].T).T
        boxed = weights @ system.joined.T
        low, high = joined_limits(there, *weights.shape)
        np.clip(boxed, low, high, out=boxed)
        begin = np.zeros_like(boxed)
        if start is not None and start.dual is not None:
            begin[:] = start.dual[whole]
        curve = np.ascontiguousarray(bands[:, whole])
        equations = _PieceEquations(right[whole], curve, low, high)
        boxed, ended = alternate(system, equations, boxed, begin, iterations, tolerance)
        inside = slice(core.start - whole.start, core.stop - whole.start)
        result.weights[core] = obeying(
            boxed[inside, :size], system.penalties[:size], bounds.at(core)
        )
        dual[core] = ended[inside]

    on_all_cores(
        solve, pieces(frames, normal, system.penalties[:size], system.half, bands, iterations)
    )
    return result


def temporal_reach(
    normal: FloatArray,
    bands: FloatArray,
    rows: FloatArray,
    iterations: int,
    covariance: FloatArray | None,
) -> int:
    """Return after how many frames the end of a take has no effect.

    Parameters are those of `solve_temporal`; `rows` (C, S) are inequalities.
    """
    system = shared_system(normal, bands, rows, covariance)
    penalties = system.penalties[: len(normal)]
    return overlap(normal, penalties, system.half, bands, iterations, _NOTHING)


def _alternate(
    system: SharedSystem,
    piece: _PieceEquations,
    boxed: FloatArray,
    dual: FloatArray,
    iterations: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    # The systems of all rotated unknowns as one: no entry couples the last frame of one with the
    # first of the next.
    diagonals = np.tile(piece.bands, (len(system.values), 1, 1))
    diagonals[:, 0, :2], diagonals[:, 1, 0] = 0.0, 0.0
    diagonals[:, 2] += system.values[:, None]
    factor = cholesky_banded(np.hstack(list(diagonals)), overwrite_ab=True, check_finite=False)
    rotation = (system.penalties[:, None] * system.joined @ system.vectors).T
    back = system.joined @ system.vectors
    constant = system.vectors.T @ piece.right.T
    for _ in range(iterations):
        rotated = constant + rotation @ (boxed - dual).T
        # LAPACK itself: `cho_solve_banded` takes ten times as long to check its arguments.
        rotated = dpbtrs(factor, rotated.ravel(), overwrite_b=True)[0].reshape(rotated.shape)
        relaxed = RELAXATION * (back @ rotated).T + (1.0 - RELAXATION) * boxed + dual
        previous, boxed = boxed, np.clip(relaxed, piece.low, piece.high)
        dual = relaxed - boxed
        if np.abs(boxed - previous).max() <= tolerance:
            break
    return boxed, dual


def _alternate_compiled(
    compiled: Any,
    system: SharedSystem,
    piece: _PieceEquations,
    boxed: FloatArray,
    dual: FloatArray,
    iterations: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Do as `_alternate` does; padding to multiples of four stays 0."""
    wide, size = system.joined.shape
    values = np.ones(size + -size % 4)
    values[:size] = system.values
    factor, rows = compiled.factorise(piece.bands, values)
    rotated = system.joined @ system.vectors
    low, high = (
        _in_fours(limit[:1] if limit.strides[0] == 0 else limit)
        for limit in (piece.low, piece.high)
    )
    boxed, dual = _in_fours(boxed), _in_fours(dual)
    compiled.alternate(
        factor,
        rows,
        _in_fours(system.penalties[:, None] * rotated, len(boxed[0])),
        _in_fours(rotated.T, len(values)),
        _in_fours(piece.right @ system.vectors),
        low,
        high,
        boxed,
        dual,
        iterations,
        RELAXATION,
        tolerance,
    )
    return boxed[:, :wide], dual[:, :wide]


def _in_fours(matrix: FloatArray, rows: int | None = None) -> FloatArray:
    """Return a copy with columns added up to a multiple of four, and rows up to `rows`."""
    rows = len(matrix) if rows is None else rows
    result = np.zeros((rows, matrix.shape[1] + -matrix.shape[1] % 4))
    result[: len(matrix), : matrix.shape[1]] = matrix
    return result


def obeying(weights: FloatArray, metric: FloatArray, bounds: Bounds) -> FloatArray:
    """Return the weights within bounds that are the nearest which keep the rows too.

    Parameters
    ----------
    weights : (F, S) float64
        Within the bounds, and the rows but for the last iteration's error.
    metric : (S,) float64
        Weights of the squared distances.
    bounds : Bounds
    """
    if not len(bounds.rows):
        return weights
    broken = np.flatnonzero((weights @ bounds.rows.T > bounds.limits).any(axis=1))
    if not len(broken):
        return weights
    result, there = weights.copy(), bounds.at(broken)
    unit = metric / metric.max()
    result[broken] = solve_bounded(np.diag(unit), weights[broken] * unit, weights[broken], there)
    return result
