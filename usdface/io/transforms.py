"""Transforms as scale, rotation and translation, and as matrices for row vectors: p @ M."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = ["along", "compose", "decompose", "followed_by", "rigid"]

_NEAR = 1e-9  # of a matrix, relative


def compose(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the row-vector matrices (..., 4, 4) that scale, rotate (x, y, z, w), then move.

    Raises
    ------
    InputError
        If a quaternion is zero.
    """
    if not rotation.any(axis=-1).all():
        raise InputError("a rotation is the zero quaternion")
    matrix = np.zeros((*translation.shape[:-1], 4, 4))
    matrix[..., :3, :3] = scale[..., None] * _turns(rotation)
    matrix[..., 3, :3] = translation
    matrix[..., 3, 3] = 1.0
    return matrix


def _turns(rotation: FloatArray) -> FloatArray:
    """Return the row-vector matrices (..., 3, 3) of quaternions (..., 4), of any length."""
    unit = rotation / np.linalg.norm(rotation, axis=-1, keepdims=True)
    x, y, z, w = np.moveaxis(unit, -1, 0)
    turn = np.empty((*rotation.shape[:-1], 3, 3))
    turn[..., 0, 0] = 1 - 2 * (y * y + z * z)
    turn[..., 0, 1] = 2 * (x * y + z * w)
    turn[..., 0, 2] = 2 * (x * z - y * w)
    turn[..., 1, 0] = 2 * (x * y - z * w)
    turn[..., 1, 1] = 1 - 2 * (x * x + z * z)
    turn[..., 1, 2] = 2 * (y * z + x * w)
    turn[..., 2, 0] = 2 * (x * z + y * w)
    turn[..., 2, 1] = 2 * (y * z - x * w)
    turn[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return turn


def decompose(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return translations (..., 3), rotations (..., 4) as x, y, z, w, and scales (..., 3).

    The inverse of `compose` where a matrix has no shear, with w >= 0; a mirror becomes a
    negative scale along x.
    """
    linear = matrix[..., :3, :3]
    scale = np.linalg.norm(linear, axis=-1)
    scale[..., 0] = np.where(np.linalg.det(linear) < 0, -scale[..., 0], scale[..., 0])
    axes = linear / np.where(scale == 0, 1.0, scale)[..., None]
    flat = np.linalg.det(axes) <= 0  # flattened by a zero scale: any rotation will do
    axes = np.where(flat[..., None, None], np.eye(3), axes).swapaxes(-1, -2)
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (*matrix.shape[:-2], 1))
    if (axes != np.eye(3)).any():
        from scipy.spatial.transform import Rotation  # costs more to import than many files need

        turned = Rotation.from_matrix(axes.reshape(-1, 3, 3)).as_quat(canonical=True)
        turn = turned.reshape(turn.shape)
    return matrix[..., 3, :3], turn, scale


def followed_by(
    translations: FloatArray, rotations: FloatArray, scales: FloatArray, then: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the transforms (F, 3), (F, 4), (F, 3), each followed by the matrix `then` (4, 4).

    Where `then` preserves angles, interpolation between frames is preserved exactly; else shear is
    left out.
    """
    linear = then[:3, :3]
    size = np.cbrt(np.linalg.det(linear))
    if size > 0 and np.allclose(
        linear @ linear.T, size**2 * np.eye(3), rtol=0, atol=_NEAR * size**2
    ):
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_matrix(linear.T / size)
        return (
            translations @ linear + then[3, :3],
            (turn * Rotation.from_quat(rotations)).as_quat(),
            scales * size,
        )
    return decompose(compose(translations, rotations, scales) @ then)


def along(rotations: FloatArray, place: FloatArray, part: FloatArray) -> FloatArray:
    """Return rotations between keys (K, 4): from key `place` (F,) the `part` (F,) to the next.

    The shortest arc at constant speed (slerp), as glTF and UsdSkel go.
    """
    start = rotations[place]
    stop = rotations[(place + 1).clip(max=len(rotations) - 1)]
    cosine = np.einsum("fk,fk->f", start, stop)
    stop = np.where(cosine[:, None] < 0, -stop, stop)
    angle = np.arccos(np.abs(cosine).clip(max=1.0))
    sine = np.sin(angle)
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    first = np.where(near, 1 - part, np.sin((1 - part) * angle) / safe)
    second = np.where(near, part, np.sin(part * angle) / safe)
    turned = first[:, None] * start + second[:, None] * stop
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def rigid(matrix: FloatArray) -> FloatArray:
    """Return the matrix (4, 4) without its scale; a mirror turns only its x axis around."""
    translation, rotation, _ = decompose(matrix)
    return compose(translation, rotation, np.ones(3))
