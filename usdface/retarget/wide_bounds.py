"""Weights of a take in wider bounds: the performer's peaks in units of the character's shapes."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.retarget.confidence import weight_deviations
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights, with_learned_covariance
from usdface.takes import frame_step

__all__ = ["AT_REST", "held_peaks", "resting_weights", "weights_in_wide_bounds"]

# A peak counts if it is held for so long [s]: three frames at 30 Hz, a spike has one or two.
_HELD = 0.1
# A movement is at rest for this share of the take at least. Set by hand.
AT_REST = 0.05


def weights_in_wide_bounds(
    displacements: FloatArray,
    motion: MotionModel,
    times: FloatArray,
    regularisation: Regularisation,
    *,
    within: tuple[float, float],
    errors: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Solve displacements with weights of the free shapes in wider bounds than 0 to 1.

    Inbetweens and combination shapes do not count.

    Parameters
    ----------
    displacements : (F, M, D) float64 [m]
        Of the markers on the character, without gaps.
    motion : MotionModel
        Of D axes, with S free shapes.
    times : (F,) float64 [s]
    regularisation : Regularisation
        The covariance of the weights is learned anew, without bounds.
    within : (float, float)
        Least and largest weight.
    errors : (M,) float64 [1], optional
        Of the markers (`usdface.retarget.marker_errors`); equal, if left out.

    Returns
    -------
    weights : (F, S) float64
    deviations : (S,) float64
        Standard deviation of each weight, by noise and misfit.
    """
    axes, free = motion.axes, motion.shapes.free
    offsets = motion.shapes.offsets[free].reshape(len(free), -1, 3)[..., :axes]
    each = 1.0 if errors is None else np.repeat(errors, axes)
    shapes = offsets.reshape(len(offsets), -1) / each
    if motion.moving_head:
        rigid = motion.head_basis(errors)
        shapes = shapes - (shapes @ rigid) @ rigid.T
    observed = displacements.reshape(len(displacements), -1) / each
    normal, right = shapes @ shapes.T, observed @ shapes.T
    plain = regularisation.unlearned()
    learned = with_learned_covariance(normal, right, times, plain)
    bounds = Bounds(*(np.asarray(bound) for bound in within))
    solved = solve_weights(normal, right, times, learned, bounds=bounds)
    return solved.weights, weight_deviations(normal, frame_step(times), plain)


def held_peaks(weights: FloatArray, times: FloatArray) -> FloatArray:
    """Return the level that each weight (F, S) reaches for a tenth of a second in all: (S,)."""
    step = frame_step(times)
    held = min(max(round(_HELD / step), 1), len(weights) // 4)
    return np.asarray(np.sort(weights, axis=0)[-max(held, 1)])


def resting_weights(weights: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the weight to which each shape comes down, of weights (F, S): (S,).

    Only the half of the frames counts in which the other shapes, with offsets (S, N), do least: a
    mouth that goes to the left is one that goes to the right by less than nothing.
    """
    low = np.quantile(weights, AT_REST, axis=0)
    moving = np.maximum(weights - low, 0.0) * np.linalg.norm(offsets, axis=1)
    others = moving.sum(axis=1, keepdims=True) - moving
    quiet = others <= np.median(others, axis=0)
    return np.asarray(np.nanquantile(np.where(quiet, weights, np.nan), AT_REST, axis=0))
