"""Infinitesimal rigid motions: the displacement fields of a head's translations and rotations."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["infinitesimal_motions", "motion_basis", "small_motions"]


def infinitesimal_motions(points: FloatArray) -> FloatArray:
    """Return three translations and three rotations about the origin: (6, M, 3).

    `points` are (M, 3).
    """
    rotations = np.cross(np.eye(3)[:, None], points)
    translations = np.broadcast_to(np.eye(3)[:, None], rotations.shape)
    return np.concatenate([translations, rotations])


def small_motions(points: FloatArray, image: bool) -> FloatArray:
    """Return small rigid motions of `points` (M, 3): (6, M, 3).

    Three translations and three rotations about their centroid; in an image, translation along
    the view is a change of size instead.
    """
    centred = points - points.mean(axis=0)
    motions = infinitesimal_motions(centred)
    if image:
        motions[2] = centred
    return motions


def motion_basis(points: FloatArray, axes: int, errors: FloatArray | None = None) -> FloatArray:
    """Return an orthonormal basis of the small motions of `points` (M, 3): (M * axes, 6).

    Of 2 `axes`, those of an image, else of 3. With the `errors` (M,) of the points: of the motions
    divided by them.
    """
    motions = small_motions(points, axes == 2)[..., :axes]
    if errors is not None:
        motions = motions / errors[:, None]
    return np.asarray(np.linalg.qr(motions.reshape(6, axes * len(points)).T)[0])
