"""The size of a take's painted dots on the character."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.geometry.marker_spread import fit_scale_and_translation
from usdface.takes import MarkerTake, visible

__all__ = ["dot_radii"]


def dot_radii(take: MarkerTake, markers: tuple[str, ...], points: FloatArray) -> FloatArray:
    """Return the radii of bound dots on the character: (B,) [m]; NaN = unknown.

    Parameters
    ----------
    take : MarkerTake
    markers : tuple of str, length B
        The bound markers.
    points : (B, 3) float64 [m]
        Where they rest on the character.
    """
    radii = np.full(len(markers), np.nan)
    known = [k for k, name in enumerate(markers) if name in take.names]
    if take.diameters is None or not known:
        return radii
    positions = take.select(tuple(markers[k] for k in known))
    positions = positions[visible(positions).sum(axis=1) > 1]
    scales = fit_scale_and_translation(points[known, : take.dimension], positions)[0]
    scales = scales[~np.isnan(scales)]
    if len(scales):
        own = [take.names.index(markers[k]) for k in known]
        radii[known] = 0.5 * take.diameters[own] / float(np.median(scales))
    return radii
