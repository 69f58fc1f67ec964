"""Weights of all frames at once, smooth in time: ADMM with one eigen-decomposition.

The alternating direction method of multipliers (Boyd et al. 2011) with over-relaxation: the
unconstrained step becomes S independent pentadiagonal systems in time, the other step clips
weights to their bounds and rows of weights to their limits.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from usdface.retarget.bounds import Bounds
from usdface.retarget.box import solve_box
from usdface.takes import FloatArray

__all__ = ["Iterate", "curvature_bands", "solve_spacetime"]

_RELAXATION = 1.6


@dataclass(frozen=True, eq=False, slots=True)
class Iterate:
    """Where a solve stands: `weights` (F, S) within their bounds, and ADMM's scaled `dual`.

    The dual is (F, S + C), with C the inequality rows.
    """

    weights: FloatArray
    dual: FloatArray | None = None


def solve_spacetime(
    normal: FloatArray,
    right: FloatArray,
    bands: FloatArray,
    bounds: Bounds,
    start: Iterate,
    iterations: int,
    tolerance: float,
) -> Iterate:
    """Minimise ``sum_t (w_t' N w_t / 2 - b_t' w_t) + sum_s w_s' K w_s / 2`` within `bounds`.

    Parameters
    ----------
    normal : (S, S) float64
        N, symmetric positive definite.
    right : (F, S) float64
        b of every frame.
    bands : (3, F) float64
        K, as `curvature_bands` gives it, in the units of `normal`.
    bounds : Bounds
    start : Iterate
    iterations : int
        Upper bound.
    tolerance : float [1]
        No iteration is done after one that changes the weights by less (RMS).
    """
    size, rows = len(normal), bounds.rows
    # Penalty per weight: measured on the ICT face with 68 landmarks at 0.01 to 1 mm noise,
    # 60 iterations reach 5e-3 everywhere and 1e-4 in the mean.
    penalty = 0.03 * np.diag(normal) + 0.02 * bands[2].max()
    # A row weighs as much as the weights it joins.
    row_penalty = 1.0 / np.maximum((rows**2 / penalty).sum(axis=1), 1e-300) if len(rows) else []
    penalties = np.concatenate([penalty, row_penalty])
    joined = np.vstack([np.eye(size), rows.reshape(-1, size)])
    values, vectors = np.linalg.eigh(normal + joined.T @ (penalties[:, None] * joined))
    factors = []
    for value in values:
        system = bands.copy()
        system[2] += value
        factors.append(cholesky_banded(system, overwrite_ab=True, check_finite=False))
    low, high = bounds.over(*right.shape)
    if len(rows):
        limits = bounds.limits_over(len(right))
        low, high = np.hstack([low, np.full(limits.shape, -np.inf)]), np.hstack([high, limits])
    boxed = np.clip(start.weights @ joined.T, low, high)
    dual = np.zeros_like(boxed) if start.dual is None else start.dual
    # Columns of the rotated unknowns lie together in memory: each is one banded solve.
    rotation, back = (penalties[:, None] * joined @ vectors).T, joined @ vectors
    constant = vectors.T @ right.T
    for _ in range(iterations):
        rotated = constant + rotation @ (boxed - dual).T
        for k, factor in enumerate(factors):
            rotated[k] = cho_solve_banded(
                (factor, False), rotated[k], overwrite_b=True, check_finite=False
            )
        relaxed = _RELAXATION * (back @ rotated).T + (1.0 - _RELAXATION) * boxed + dual
        previous, boxed = boxed, np.clip(relaxed, low, high)
        dual = relaxed - boxed
        if np.sqrt(np.mean((boxed - previous) ** 2)) < tolerance:
            break
    return Iterate(_obeying(boxed[:, :size], penalty, bounds), dual)


def _obeying(weights: FloatArray, metric: FloatArray, bounds: Bounds) -> FloatArray:
    """Return the weights (F, S) within bounds that are the nearest which keep the rows too."""
    if not len(bounds.rows):
        return weights
    broken = np.flatnonzero((weights @ bounds.rows.T > bounds.limits).any(axis=1))
    if not len(broken):
        return weights
    result, there = weights.copy(), bounds.at(broken)
    unit = metric / metric.max()
    result[broken] = solve_box(np.diag(unit), weights[broken] * unit, weights[broken], there)
    return result


def curvature_bands(times: FloatArray) -> FloatArray:
    """Return the pentadiagonal matrix of ``integral |w''|^2 dt`` for samples at `times`.

    Returns
    -------
    (3, F) float64 [1/s^3]
        Upper banded storage, as `scipy.linalg.solveh_banded` takes it; uneven times are
        allowed, fewer than three give zeros.
    """
    count = len(times)
    bands = np.zeros((3, count))
    if count < 3:
        return bands
    step = np.diff(times)
    span = step[:-1] + step[1:]
    # w'' at an inner sample as a combination of three neighbours, times sqrt(span / 2).
    scale = np.sqrt(span / 2.0) * 2.0 / span
    left, right = scale / step[:-1], scale / step[1:]
    middle = -(left + right)
    bands[2, :-2] += left**2
    bands[2, 1:-1] += middle**2
    bands[2, 2:] += right**2
    bands[1, 1:-1] += left * middle
    bands[1, 2:] += middle * right
    bands[0, 2:] += left * right
    return bands
