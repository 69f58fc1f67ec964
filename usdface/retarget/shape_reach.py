"""Reach of the blend shapes at the markers: how far any weights take a marker one way.

Weights in [0, 1] take a vertex with offsets d_s to a point of the zonotope of all d_s, whose
support in the direction u is the sum of max(u . d_s, 0) (R. Schneider 2014, Convex Bodies: The
Brunn-Minkowski Theory, 3.5). A marker that moves further than that is left behind by at least the
rest, whatever the weights are.
"""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["beyond_reach"]


def beyond_reach(displaced: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the least distance to the markers that weights in [0, 1] must leave.

    Parameters
    ----------
    displaced : (F, M, 3) float64 [m]
        Displacements of the markers on the character from rest.
    offsets : (S, M, 3) float64 [m]
        Of the blend shapes at their vertices, combination shapes included; not of inbetweens.

    Returns
    -------
    (F, M) float64 [m]
        0 where the shapes reach as far as the marker in its direction.
    """
    length = np.linalg.norm(displaced, axis=2)
    along = displaced.transpose(1, 0, 2) @ offsets.transpose(1, 2, 0)
    reach = np.maximum(along, 0.0).sum(axis=2).T
    reach = np.divide(reach, length, out=np.zeros_like(length), where=length > 0.0)
    return np.asarray(np.maximum(length - reach, 0.0))
