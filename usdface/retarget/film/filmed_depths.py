"""Depths of the markers from one camera, by parallax as the head turns."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.image_residual import image_residual
from usdface.retarget.film.one_camera import PinholeCamera

__all__ = ["DEPTH_SPREAD", "error_directions", "refined_depths"]

# Standard deviation of a marker's depth between two people, of the face's size: 4 mm, as between
# the faces of the ICT model (identity modes).
DEPTH_SPREAD = 0.08
# Least deviation of the residual, of the face's size. A pose that absorbs some of an expression
# turns a head that rests; with a very small residual these turns would be taken for parallax. By
# 0.003, 0.01 and 0.03 a filmed head at rest (10 s by a phone, the recorded curves from 100 s on)
# has weights that are off by 0.108, 0.095 and 0.095, without it by 0.110.
_MISFIT = 0.01


def refined_depths(
    film: FilmedTake,
    camera: PinholeCamera,
    look: Pose,
    pose: Pose,
    rest: FloatArray,
    weights: FloatArray,
    sure: FloatArray,
) -> tuple[FloatArray, float]:
    """Refine the neutral markers' depths by the parallax of a turning head.

    A marker that is deeper than assumed lies on the same ray in the neutral frames, but off its
    prediction once the head turns. One step of least squares, with the character's depths as a
    prior. Poses are free, weights are free within a ridge, and positions across the rays within the
    noise of the neutral frames: motion that an expression explains is not evidence of depth.

    Parameters
    ----------
    film : FilmedTake
    camera : PinholeCamera
    look, pose : Pose
        Of the neutral, one frame, and of all frames.
    rest : (M, 3) float64 [m]
        The markers where they rest.
    weights : (F, S) float64
        With which the film was solved.
    sure : (F, M) float64
        As of `usdface.retarget.film.filmed_head.certainty`.

    Returns
    -------
    depths : (M,) float64 [m]
    deviation : float [m]
        Standard deviation of a depth (RMS).
    """
    size = rms_radius(film.face)
    moved = film.moved(weights)
    residual = image_residual(film, camera, pose, rest, moved, sure, _MISFIT * size)
    residual = residual.with_shape_errors(film.moving.offsets, weights, moved)
    directions = error_directions(film, camera, look).transpose(0, 2, 1)
    normal, right = residual.equations(directions[None])
    prior = residual.variance / (DEPTH_SPREAD * size) ** 2
    right[2::3] -= prior * (rest[:, 2] - film.face[:, 2])
    across = residual.neutral_prior(film.neutral)
    normal += np.diag(np.tile([across, across, prior], len(rest)))
    covariance = np.linalg.inv(normal)
    deviation = np.sqrt(residual.variance * np.diag(covariance)[2::3].mean())
    return rest[:, 2] + (covariance @ right)[2::3], float(deviation)


def error_directions(film: FilmedTake, camera: PinholeCamera, look: Pose) -> FloatArray:
    """Return the directions of the markers' errors: across, and along their rays (M, 3, 3)."""
    directions = np.tile(np.eye(3), (len(film.face), 1, 1))
    directions[:, 2] = camera.rays(film.rest) @ look.rotations[0]
    directions[:, 2] /= directions[:, 2, 2:]
    return directions
