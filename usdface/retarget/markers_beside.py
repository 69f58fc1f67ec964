"""The report of markers that were placed beside their vertices."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius

__all__ = ["markers_beside"]

# Reported where a marker is this share of the face's size off: 1.5 mm on the ICT face.
_BESIDE = 0.025


def markers_beside(
    shifts: FloatArray, points: FloatArray, names: tuple[str, ...], source: str
) -> list[Finding]:
    """Return the finding that markers sit beside their vertices, if one does.

    Parameters
    ----------
    shifts : (M, 3) float64 [m]
        From the vertices that they are bound to.
    points : (M, 3) float64 [m]
        Where they sit on the character.
    names : tuple of str, length M
    source : str
        The take.
    """
    away = np.linalg.norm(shifts, axis=1)
    farthest = int(away.argmax())
    if away[farthest] < _BESIDE * rms_radius(points):
        return []
    message = (
        "markers sit {median_mm:.1f} mm from their vertices in the median, {marker} "
        "{largest_mm:.1f} mm; the solve uses these places. The shot keeps the vertices; "
        'solve:places = "bound" holds markers on them'
    )
    return [
        finding(
            "MARKER_BESIDE",
            source,
            message,
            1000 * np.median(away),
            names[farthest],
            1000 * away[farthest],
        )
    ]
