"""The matrices of a solve over time that all frames share, with the penalties of its steps."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.retarget.solver.bounds import Bounds

__all__ = ["SharedSystem", "joined_limits", "shared_system"]

# Penalty of a weight: of its own diagonal entry, and of the curvature's but at most so many times
# the least eigenvalue. High frame rates make the curvature's huge, though the weights of a take are
# no less smooth. Tried on the ICT face, 68 landmarks, 24 to 120 Hz, 0.1 to 1 mm noise.
_PENALTY = (0.06, 0.02)
_STIFFEST = 60.0
# The same with a learned covariance; the curvature's part is at most so many times the usual
# diagonal entry of the normal matrix. Tried on the first half of recorded curves, also at 120 Hz,
# with 24 to 68 markers on the ICT face and MakeHuman's, and on performers with other movements.
_LEARNED_PENALTY = (0.16, 0.04)
_USUAL = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class SharedSystem:
    """The matrices that all frames share.

    Attributes
    ----------
    normal : (S, S) float64
    joined : (S + C, S) float64
        To the clipped unknowns: the weights, then the rows of the bounds.
    penalties : (S + C,) float64
    values, vectors : (S,) and (S, S) float64
        Of the normal matrix with penalties: both it and M^-1 are diagonal in the vectors.
    half : (S, S) float64
        L of M = L L'.
    """

    normal: FloatArray
    joined: FloatArray
    penalties: FloatArray
    values: FloatArray
    vectors: FloatArray
    half: FloatArray


def shared_system(
    normal: FloatArray, bands: FloatArray, rows: FloatArray, covariance: FloatArray | None = None
) -> SharedSystem:
    """Return the matrices of `usdface.retarget.solver.temporal_solve.solve_temporal`.

    Parameters are those of it; `rows` (C, S) are inequalities.
    """
    size = len(normal)
    half: FloatArray = np.eye(size)
    if covariance is None:
        usual = 1.0
        (own, bent), most = _PENALTY, _STIFFEST * np.linalg.eigvalsh(normal)[0]
    else:
        half = np.linalg.cholesky(covariance).astype(np.float64)
        usual = covariance.trace() / size
        (own, bent), most = _LEARNED_PENALTY, _USUAL * np.median(np.diag(normal))
    penalty = own * np.diag(normal) + min(bent * bands[2].max() / usual, float(most))
    rows = rows.reshape(-1, len(normal))
    # The penalty of a row is that of the weights it couples.
    row_penalty = 1.0 / np.maximum((rows**2 / penalty).sum(axis=1), 1e-300)
    penalties = np.concatenate([penalty, row_penalty])
    joined = np.vstack([np.eye(len(normal)), rows])
    whole = normal + joined.T @ (penalties[:, None] * joined)
    values, vectors = np.linalg.eigh(half.T @ whole @ half)
    return SharedSystem(normal, joined, penalties, values, half @ vectors, half)


def joined_limits(bounds: Bounds, frames: int, size: int) -> tuple[FloatArray, FloatArray]:
    """Return the limits of weights and rows: two (F, S + C)."""
    low, high = bounds.over(frames, size)
    if not len(bounds.rows):
        return low, high
    limits = bounds.limits_over(frames)
    return np.hstack([low, np.full(limits.shape, -np.inf)]), np.hstack([high, limits])
