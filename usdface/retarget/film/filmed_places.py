"""The true places of filmed markers on the skin, by their motion in the image.

As `usdface.retarget.places` for markers in space. The head's poses, the weights and the depths of
the performer's face, which the image does not show, are free.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.marker_spread import rms_radius
from usdface.retarget.film.filmed_depths import DEPTH_SPREAD, error_directions
from usdface.retarget.film.filmed_head import certainty
from usdface.retarget.film.filmed_take import Sized
from usdface.retarget.film.image_residual import ImageResidual, image_residual
from usdface.retarget.film.solve_film import SolvedFilm
from usdface.retarget.places import PlaceGuess
from usdface.takes import visible

__all__ = ["refined_shifts"]

# A marker moves unlike its place if its residual is so many times the median marker's. Set by hand.
_UNLIKE = 2.0
# Frames sampled for the search of a place: a bound on time.
_SEARCHED = 300


def refined_shifts(
    solved: SolvedFilm,
    shifts: FloatArray,
    guess: PlaceGuess,
    surface: MarkerSurface,
    *,
    search: bool,
) -> FloatArray:
    """Return more probable shifts (M, 3) [m] of the places by a solved film: a Gauss-Newton step.

    Parameters
    ----------
    solved : SolvedFilm
        With these places, of M markers.
    shifts : (M, 3) float64 [m]
        From the vertices of `surface`.
    guess : PlaceGuess
        The prior.
    surface : MarkerSurface
        Around the markers' vertices.
    search : bool
        Search for the places of markers that move unlike theirs.
    """
    film, head, weights = solved.film, solved.head, solved.weights
    placed = surface.at(shifts).mapped(film.sized)
    count = len(shifts)
    sure = certainty(head.facing, visible(film.image), head.errors)
    still = film.without(head.beside)
    residual = image_residual(still, head.camera, head.pose, head.rest, head.moved, sure, 0.0)
    if residual.variance <= 0.0:
        return shifts
    along = np.stack(
        [one.displacements(weights).reshape(len(weights), -1, 3) for one in placed.slopes], axis=-1
    )
    # The first two columns of a marker are its place, the others errors of its neutral.
    beside = error_directions(still, head.camera, head.rest_pose).transpose(0, 2, 1)
    columns = np.concatenate([along, np.broadcast_to(beside, (len(along), *beside.shape))], axis=-1)
    normal, right = residual.equations(columns)
    deep = residual.variance / (DEPTH_SPREAD * rms_radius(film.face)) ** 2
    across = residual.neutral_prior(film.neutral)
    prior = block_diag(*[np.diag([0.0, 0.0, across, across, deep])] * count)
    ways = block_diag(*placed.tangents.transpose(0, 2, 1))
    before = guess.precision(ways)
    own = (5 * np.arange(count)[:, None] + np.arange(2)).ravel()
    prior[np.ix_(own, own)] = residual.variance * before
    right[own] += residual.variance * before @ ways.T @ (guess.mean - shifts).ravel()
    right[4::5] -= deep * (head.rest[:, 2] - film.face[:, 2])
    step = np.linalg.solve(normal + prior, right)[own]
    refined = shifts + (ways @ step).reshape(-1, 3)
    if not search:
        return surface.within_reach(refined)
    away = _mean_squares(residual.left, visible(film.image))
    usual = float(np.median(away))
    if usual > 0.0:
        # The residual of one marker among many would hide in the variance of all.
        residual = replace(residual, variance=residual.variance * usual / float(away.mean()))
    for marker in np.flatnonzero(away > _UNLIKE**2 * usual).tolist():
        refined[marker] = _searched(
            marker, surface, residual, head.moved, weights, guess, film.sized
        )
    return surface.within_reach(refined)


def _mean_squares(left: FloatArray, is_visible: BoolArray) -> FloatArray:
    """Return the mean squares of the markers' residuals (F, M, 2): (M,)."""
    squares = (left**2).sum(axis=(0, 2))
    return np.asarray(squares / np.maximum(is_visible.sum(axis=0), 1))


def _searched(
    marker: int,
    surface: MarkerSurface,
    residual: ImageResidual,
    moved: FloatArray,
    weights: FloatArray,
    guess: PlaceGuess,
    sized: Sized,
) -> FloatArray:
    """Return the shift (3,) [m] of one marker to the nearby vertex that moves most like it.

    Parameters
    ----------
    marker : int
    surface : MarkerSurface
    residual : ImageResidual
    moved : (F, M, 3) float64 [m]
        The markers' displacements at their present places.
    weights : (F, S) float64
    guess : PlaceGuess
    sized : callable
        `FilmedTake.sized`.
    """
    near = surface.vertices_near(marker)
    frames = np.arange(0, len(weights), max(1, len(weights) // _SEARCHED))
    evaluator, _ = evaluator_of(surface.mesh.shapes, near)
    there = sized(evaluator).displacements(weights[frames]).reshape(len(frames), -1, 3)
    change = (there - moved[frames, None, marker]) @ residual.slopes[frames, marker].transpose(
        0, 2, 1
    )
    error = ((residual.left[frames, None, marker] - change) ** 2).sum(axis=(0, 2))
    shifts = surface.mesh.points[near] - surface.mesh.points[surface.vertices[marker]]
    error *= len(weights) / len(frames) / residual.variance
    return np.asarray(shifts[(error + guess.improbability(marker, shifts)).argmin()])
