"""The error of a noisy neutral, as the whole take shows it.

The neutral is a mean of noisy frames, and the displacements of all frames share its error. The
lower bound of the weights reveals it: an error that only negative weights would explain leaves a
residual in most frames.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.numerics.ramps import linear_ramp
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import Iterate
from usdface.retarget.take_rows import TakeRows

__all__ = ["bootstrap_residual", "neutral_correction"]


# Weights up to the first number of their standard deviations rest in the bootstrap, from the second
# on they are as solved: noise lifts resting weights off 0 half the time, and from there a second
# take's noise meets the bound less often. Of a step at 0, 1, 2 and 3 of them: weights that mostly
# rest are off by 1.10, 1.06, 1.00 and 0.99 times as much as without a correction, where the neutral
# is exact (three seeds of tests/retarget/test_pose_and_weights.py); recorded ones, many small and
# few 0, by 0.338, 0.334, 0.335 and 0.348 of the exact ones' error (30 frames of 0.3 mm), and after
# 5 frames by 0.390, 0.390, 0.397 and 0.411 (python -m benchmarks.known_answer). At a step
# the rounding of a file could decide; from 0.5 to 1.5 it is as with a step at 1.
_RESTING = (0.5, 1.5)
_MIRROR = np.array([-1.0, 1.0, 1.0])
# Markers are ordered along this direction: by depth, but not so that rounding decides between those
# of a symmetric face, which are as deep as each other.
_ORDER = np.array([1e-3, 1e-2, 1.0])


def bootstrap_residual(
    rows: TakeRows,
    points: FloatArray,
    seen: BoolArray,
    times: FloatArray,
    regularisation: Regularisation,
    iterate: Iterate,
) -> FloatArray:
    """Return the mean residual (M, axes) [m] that noise leaves where weights cannot fall below 0.

    Measured on takes with the same weights and as much noise, but an exact neutral (parametric
    bootstrap: Efron and Tibshirani 1993, An Introduction to the Bootstrap, 6.5). First ones tell
    the error of the weights; those that may be 0 by it are smaller in the others, or 0. Markers
    that are not `seen` (F, M), at `times` (F,) [s], have no noise. It is drawn by their places
    `points` (M, 3), whatever their order.

    Each noise is used with either sign (antithetic variates: Hammersley and Morton 1956): the mean
    of the noise itself, half as large again as what the bounds leave, cancels. And it is used
    mirrored, so that a mirrored face gets the mirrored result.
    """
    noises = _drawn_noises(points, seen, rows.axes)
    noises = np.where(seen[..., None], regularisation.noise * noises, 0.0)
    flat = noises.reshape(len(noises), len(seen), -1) * rows.errors
    weights = iterate.weights

    def solved_again(weights: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
        simulated = rows.displacements(weights) + noise
        again = rows.solve(simulated, times, regularisation, iterate).weights
        return again, simulated - rows.displacements(again)

    squared = [((solved_again(weights, noise)[0] - weights) ** 2).mean(axis=0) for noise in flat]
    deviation = np.maximum(np.sqrt(np.mean(squared, axis=0)), 1e-12)
    resting = linear_ramp(weights / deviation, *_RESTING) * weights
    left = np.mean([solved_again(resting, noise)[1] for noise in (*flat, *-flat)], axis=0)
    count = np.maximum(seen.sum(axis=0), 1)[:, None]
    seen_left = np.where(seen[..., None], left.reshape(*seen.shape, -1), 0.0)
    return np.asarray(seen_left.sum(axis=0) / count)


def _drawn_noises(points: FloatArray, seen: BoolArray, axes: int) -> FloatArray:
    """Return normal noise by the places (M, 3), and that of the mirrored face: (2, F, M, axes)."""
    drawn = np.random.default_rng(0).standard_normal((*seen.shape, axes))
    noises = np.empty((2, *drawn.shape))
    noises[0][:, (points @ _ORDER).argsort(kind="stable")] = drawn
    noises[1][:, (points * _MIRROR @ _ORDER).argsort(kind="stable")] = drawn * _MIRROR[:axes]
    return noises


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
    seen : (F, M) bool
    frames : (M,) int64
        That each marker's neutral is the mean of.
    regularisation : Regularisation
        Of the solve: noise and misfit.
    rigid : (3 M, K) float64
        Small head motions, orthonormal: what they explain is no error of the neutral.
    """
    noise, misfit = regularisation.noise**2, regularisation.misfit**2
    count = np.maximum(seen.sum(axis=0), 1)
    expected = noise / np.maximum(frames, 1)
    misfit = max(0.0, misfit - float(expected.mean()))  # the neutral's error looks like it
    share = expected / np.maximum(expected + noise / count + misfit, 1e-300)
    mean = np.where(seen[..., None], leftover, 0.0).sum(axis=0) / count[:, None]
    correction = (share[:, None] * (before - mean)).ravel()
    return np.asarray((correction - rigid @ (rigid.T @ correction)).reshape(-1, 3))
