"""Weights of all frames at once, smooth in time, where every frame has its own normal matrix.

The alternating direction method of multipliers, as `usdface.retarget.solver.temporal_solve` has it
for one normal matrix: here the unconstrained step is one block-banded system of all frames, of
which the Cholesky factor is kept.
"""

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpbtrs

from usdface.arrays import FloatArray
from usdface.retarget.solver.backend import on_all_cores
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.parallel_pieces import pieces
from usdface.retarget.solver.shared_system import joined_limits, shared_system
from usdface.retarget.solver.temporal_solve import RELAXATION, Iterate, obeying

__all__ = ["solve_by_frame"]


def solve_by_frame(
    normals: FloatArray,
    right: FloatArray,
    bands: FloatArray,
    bounds: Bounds,
    start: Iterate | None,
    iterations: int,
    tolerance: float,
) -> Iterate:
    """Minimise ``sum_t (w_t' N_t w_t / 2 - b_t' w_t) + tr(W' K W) / 2`` within `bounds`.

    Parameters
    ----------
    normals : (F, S, S) float64
        N of every frame, symmetric positive definite.
    right : (F, S) float64
        b of every frame.
    bands, bounds, start, iterations, tolerance
        As of `usdface.retarget.solver.temporal_solve.solve_temporal`.
    """
    frames, size = right.shape
    system = shared_system(normals.mean(axis=0), bands, bounds.rows)
    held = system.joined.T @ (system.penalties[:, None] * system.joined)
    spread = system.penalties[:, None] * system.joined
    weights, dual = np.empty(right.shape), np.zeros((frames, len(system.joined)))

    def solve(piece: tuple[slice, slice]) -> None:
        core, whole = piece
        there = bounds.at(whole)
        factor = cholesky_banded(
            _upper_bands(normals[whole] + held, bands[:, whole]),
            overwrite_ab=True,
            check_finite=False,
        )
        low, high = joined_limits(there, whole.stop - whole.start, size)
        boxed = np.zeros(low.shape) if start is None else start.weights[whole] @ system.joined.T
        boxed = np.clip(boxed, low, high)
        scaled = np.zeros(boxed.shape)
        if start is not None and start.dual is not None:
            scaled[:] = start.dual[whole]
        for _ in range(iterations):
            pulled = right[whole] + (boxed - scaled) @ spread
            free, _ = dpbtrs(factor, pulled.ravel(), overwrite_b=True)
            relaxed = RELAXATION * (free.reshape(-1, size) @ system.joined.T)
            relaxed += (1.0 - RELAXATION) * boxed + scaled
            before, boxed = boxed, np.clip(relaxed, low, high)
            scaled = relaxed - boxed
            if np.abs(boxed - before).max(initial=0.0) <= tolerance:
                break
        inside = slice(core.start - whole.start, core.stop - whole.start)
        weights[core] = obeying(boxed[inside, :size], system.penalties[:size], bounds.at(core))
        dual[core] = scaled[inside]

    # The least eigenvalue of any frame bounds how far the ends of a piece reach.
    least = np.linalg.eigvalsh(normals)[:, 0].min() * np.eye(size)
    on_all_cores(
        solve, pieces(frames, least, system.penalties[:size], system.half, bands, iterations)
    )
    return Iterate(weights, dual)


def _upper_bands(normals: FloatArray, bands: FloatArray) -> FloatArray:
    """Return the matrix of all frames in upper banded storage: (2 S + 1, F S)."""
    frames, size, _ = normals.shape
    result = np.zeros((2 * size + 1, frames, size))
    row, column = np.triu_indices(size)
    result[2 * size + row - column, :, column] = normals[:, row, column].T
    for apart in range(3):
        result[(2 - apart) * size] += bands[2 - apart][:, None]
    return result.reshape(2 * size + 1, frames * size)
