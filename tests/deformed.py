"""Where the points of a mesh are at some weights, as plainly as can be: a judge."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.rigs import Mesh

__all__ = ["deformed"]


def deformed(mesh: Mesh, weights: FloatArray) -> FloatArray:
    """Return the points at one set of weights (S,), linearly, without inbetweens: (V, 3) [m]."""
    points = np.array(mesh.points)
    for shape, weight in zip(mesh.shapes, weights, strict=True):
        points[shape.indices] += weight * shape.offsets
    return points
