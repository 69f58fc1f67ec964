"""The error of a noisy neutral, as the whole take shows it.

The neutral is a mean of noisy frames, and the displacements of all frames share its error. The
lower bound of the weights reveals it: an error that only negative weights would explain leaves a
residual in most frames.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import Iterate
from usdface.retarget.take_rows import TakeRows

__all__ = ["bootstrap_residual", "neutral_correction"]


def bootstrap_residual(
    rows: TakeRows,
    points: FloatArray,
    seen: BoolArray,
    times: FloatArray,
    regularisation: Regularisation,
    iterate: Iterate,
) -> FloatArray:
    """Return the mean residual (M, axes) [m] that noise leaves where weights cannot fall below 0.

    Measured on a take with the same weights and as much noise, but an exact neutral (parametric
    bootstrap: Efron and Tibshirani 1993, An Introduction to the Bootstrap, 6.5). Markers that are
    not `seen` (F, M) have no noise. It is drawn by their places `points` (M, 3), whatever their
    order.
    """
    predicted = rows.displacements(iterate.weights)
    drawn = np.random.default_rng(0).standard_normal((*seen.shape, rows.axes))
    noise = np.empty_like(drawn)
    noise[:, np.lexsort(points.T)] = drawn
    noise = np.where(seen[..., None], regularisation.noise * noise, 0.0)
    simulated = predicted + noise.reshape(predicted.shape)
    again = rows.solve(simulated, times, regularisation, iterate)
    left = (simulated - rows.displacements(again.weights)).reshape(*seen.shape, -1)
    count = np.maximum(seen.sum(axis=0), 1)
    return np.asarray(np.where(seen[..., None], left, 0.0).sum(axis=0) / count[:, None])


def neutral_correction(
    before: FloatArray,
    leftover: FloatArray,
    seen: BoolArray,
    frames: IntArray,
    regularisation: Regularisation,
    rigid: FloatArray,
) -> FloatArray:
    """Return the correction of all displacements for the neutral's error: (M, 3) [m].

    The neutral is as uncertain as the mean of noisy frames; the mean residual of the take is an
    estimate of its error, up to the misfit, which is correlated in time.

    Parameters
    ----------
    before : (M, 3) float64 [m]
        The correction that `leftover` includes.
    leftover : (F, M, 3) float64 [m]
        Residuals; any value where `seen` is False.
    frames : (M,) int64
        That each marker's neutral is the mean of.
    """
    noise, misfit = regularisation.noise**2, regularisation.misfit**2
    count = np.maximum(seen.sum(axis=0), 1)
    expected = noise / np.maximum(frames, 1)
    misfit = max(0.0, misfit - float(expected.mean()))  # the neutral's error looks like it
    share = expected / np.maximum(expected + noise / count + misfit, 1e-300)
    mean = np.where(seen[..., None], leftover, 0.0).sum(axis=0) / count[:, None]
    correction = (share[:, None] * (before - mean)).ravel()
    return np.asarray((correction - rigid @ (rigid.T @ correction)).reshape(-1, 3))
