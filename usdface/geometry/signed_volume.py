"""The signed volume of a mesh: whether its faces look outwards."""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.triangulation import triangle_fans

__all__ = ["signed_volume"]


def signed_volume(points: FloatArray, face_counts: IntArray, face_indices: IntArray) -> float:
    """Return the volume of the cones from the middle of the points to the faces [m3].

    Negative where most faces look inwards, of an open mesh as well. Faces are fans of triangles (C.
    Zhang, T. Chen, "Efficient feature extraction for 2D/3D objects in mesh representation", 2001).

    Parameters
    ----------
    points : (V, 3) float64 [m]
    face_counts : (P,) int64
    face_indices : (C,) int64
    """
    around = points - points.mean(axis=0)
    corners, _ = triangle_fans(face_counts)
    a, b, c = (around[face_indices[corner]] for corner in corners.T)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
