"""The errors of filmed markers, by those of the markers around them.

As `usdface.retarget.marker_errors` for markers in space: a dot whose track drifts, jumps to another
spot or trembles counts less in the head's pose, in its depths and in the weights.
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.retarget.film.solve_film import SolvedFilm
from usdface.retarget.marker_errors import estimate_marker_errors
from usdface.retarget.motion_model import MotionModel

__all__ = ["filmed_marker_errors"]


def filmed_marker_errors(solved: SolvedFilm) -> FloatArray:
    """Return the errors of the markers of a solved film, by those around them: (M,) [1]."""
    film, head = solved.film, solved.head
    take, views = head.projected(film.take)
    # Residual of the image, in head space.
    left = take.positions - head.rest[:, :2] - (views.slopes @ head.moved[..., None])[..., 0]
    left = _without_depths(left, views.slopes)
    displaced = head.moved + (left[:, :, None] @ views.slopes)[:, :, 0]
    motion = MotionModel(head.rest, film.moving.marker_evaluator, axes=2, moving_head=True)
    variance = (solved.left / head.metre) ** 2
    return estimate_marker_errors(film.take.times, solved.weights, displaced, motion, variance)


def _without_depths(left: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return residuals (F, M, 2) [m] without those of a rest place that is off in depth.

    Parameters
    ----------
    left : (F, M, 2) float64 [m]
        NaN where occluded.
    slopes : (F, M, 2, 3) float64
        Of the views.
    """
    deep = slopes[..., 2]
    seen = np.where(np.isnan(left), 0.0, deep)
    squares = (seen**2).sum(axis=(0, 2))
    off = (seen * np.nan_to_num(left)).sum(axis=(0, 2)) / np.maximum(squares, 1e-12)
    return np.asarray(left - deep * off[:, None])
