"""Residuals by region: distances of the markers of each region from the solved face."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.regions import regions_of
from usdface.numerics.rms import rms

__all__ = ["region_errors", "region_residuals"]


def region_residuals(
    face: BoundFace, markers: Sequence[str], distances: FloatArray
) -> dict[str, FloatArray]:
    """Return, for each region, the RMS distance of its visible markers from the solved face.

    Parameters
    ----------
    face : BoundFace
    markers : sequence of str, length M
        The markers that were solved.
    distances : (F, M) float64 [m]
        Of each marker from the solved face; NaN where occluded.

    Returns
    -------
    dict of str to (F,) float64 [m]
        0 in frames in which all markers of a region are occluded.
    """
    own = _by_region(face, markers, distances)
    return {region: rms(values, axis=1) for region, values in own.items()}


def region_errors(
    face: BoundFace, markers: Sequence[str], distances: FloatArray
) -> dict[str, dict[str, Any]]:
    """Return the residual of each region for a report [mm]: over the take, and frame by frame.

    Parameters are those of `region_residuals`.
    """
    result = {}
    for region, own in _by_region(face, markers, distances).items():
        curve = rms(own, axis=1)
        result[region] = {
            "markers": own.shape[1],
            "rms": round(1000.0 * rms(own, empty=np.nan), 3),
            "worst": round(1000.0 * float(curve.max()), 3),
            "worst_frame": int(curve.argmax()),
            "frames": np.round(1000.0 * curve, 3).tolist(),
        }
    return result


def _by_region(
    face: BoundFace, markers: Sequence[str], distances: FloatArray
) -> dict[str, FloatArray]:
    """Return the distances of the markers of each region: (F, m) each."""
    regions = np.array(regions_of(face.mesh, face.vertices_of(markers)))
    return {str(region): distances[:, regions == region] for region in np.unique(regions)}
