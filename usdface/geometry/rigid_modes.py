"""Small rigid motions: what a head does to its markers, as directions."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["motion_basis", "small_motions"]


def small_motions(points: FloatArray, image: bool) -> FloatArray:
    """Return small rigid motions of `points` (M, 3): (6, M, 3).

    Three translations and three rotations; seen in an image, moving along the view is a
    change of size instead.
    """
    centred = points - points.mean(axis=0)
    columns = np.zeros((6, *points.shape))
    for axis in range(3):
        columns[axis, :, axis] = 1.0
        columns[3 + axis] = np.cross(np.eye(3)[axis], centred)
    if image:
        columns[2] = centred
    return columns


def motion_basis(points: FloatArray, axes: int) -> FloatArray:
    """Return an orthonormal basis of the small motions of `points` (M, 3): (M * axes, 6).

    Of 2 `axes`, those of an image, else of 3.
    """
    motions = small_motions(points, axes == 2)[..., :axes]
    return np.asarray(np.linalg.qr(motions.reshape(6, axes * len(points)).T)[0])
