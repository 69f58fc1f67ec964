"""The size of a point set: the RMS distance of its points from their centroid."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = ["fit_scale_and_translation", "marker_spread", "rms_radius"]

# Squared extents below this share of the squared distance to the origin are rounding.
_ROUNDING = 1e-24


def rms_radius(points: FloatArray) -> float:
    """Return the RMS distance of points (N, D) from their centroid, in their own unit."""
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def fit_scale_and_translation(
    points: FloatArray, positions: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit scale and translation of points to their positions in each frame, without rotation.

    Parameters
    ----------
    points : (M, D) float64
    positions : (F, M, D) float64
        NaN where occluded; at least two are seen in each frame.

    Returns
    -------
    scales : (F,) float64
        Of the positions' unit to the points'; NaN where either are all at one place.
    middles : (F, D) float64
        Of the seen positions.
    own_middles : (F, D) float64
        Of the points that these are of.
    """
    seen = ~np.isnan(positions[..., :1])
    count = seen.sum(axis=1)
    middles = np.where(seen, positions, 0.0).sum(axis=1) / count
    own_middles = np.where(seen, points, 0.0).sum(axis=1) / count
    spread = np.where(seen, positions - middles[:, None], 0.0)
    own = np.where(seen, points - own_middles[:, None], 0.0)
    squares, own_squares = ((values**2).sum(axis=(1, 2)) for values in (spread, own))
    apart = squares > _ROUNDING * (middles**2).sum(axis=1)
    apart &= own_squares > _ROUNDING * (own_middles**2).sum(axis=1)
    scales = np.sqrt(squares / np.where(apart, own_squares, np.nan))
    return scales, middles, own_middles


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
