"""Numbers as the arrays of USD's value types (Vt), and vectors back from them."""

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Vt

from usdface.arrays import FloatArray

__all__ = ["matrices", "vec2f_array", "vec3f_array", "vectors_of"]


def vec3f_array(values: ArrayLike) -> Vt.Vec3fArray:
    """Return (N, 3) numbers as a Vt.Vec3fArray."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 3))


def vec2f_array(values: ArrayLike) -> Vt.Vec2fArray:
    """Return (N, 2) numbers as a Vt.Vec2fArray."""
    return Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 2))


def matrices(values: ArrayLike) -> Vt.Matrix4dArray:
    """Return (N, 4, 4) row-vector matrices as a Vt.Matrix4dArray."""
    array = np.asarray(values, dtype=np.float64).reshape(-1, 4, 4)
    return Vt.Matrix4dArray([Gf.Matrix4d(*m.ravel().tolist()) for m in array])


def vectors_of(value: object) -> FloatArray:
    """Return the vectors (N, 3) of an attribute's value, none where it has none."""
    return np.zeros((0, 3)) if value is None else np.asarray(value, np.float64)
