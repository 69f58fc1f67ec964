"""The size of a point set: the RMS distance of its points from their centroid."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = ["marker_spread", "rms_radius"]


def rms_radius(points: FloatArray) -> float:
    """Return the RMS distance of points (N, D) from their centroid, in their own unit."""
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def marker_spread(neutral: FloatArray) -> float:
    """Return the face unit: the RMS distance [m] of the neutral markers from their centroid.

    It scales with the face, does not depend on how the head is turned and needs no particular
    marker. It does depend on which markers there are, so a system is carried between faces
    that wear the same ones.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]

    Raises
    ------
    InputError
        If fewer than two markers are seen, or all lie on one spot.
    """
    seen = neutral[~np.isnan(neutral).any(axis=1)]
    spread = 0.0
    if len(seen):
        spread = rms_radius(seen)
    if not spread > 0:
        raise InputError("the neutral markers have no extent; the face unit cannot be taken")
    return spread
