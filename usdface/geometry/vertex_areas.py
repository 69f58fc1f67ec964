"""Areas of the surface around the vertices of a triangle mesh."""

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["vertex_areas"]


def vertex_areas(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return a third of the area of the triangles (T, 3) around each of the points (V, 3): (V,).

    The barycentric areas of M. Meyer, M. Desbrun, P. Schröder, A. Barr, "Discrete
    Differential-Geometry Operators for Triangulated 2-Manifolds", 2003, sec. 3.
    """
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    areas = np.bincount(triangles.ravel(), np.repeat(thirds, 3), len(points))
    return areas.astype(np.float64)  # of no triangles bincount counts
