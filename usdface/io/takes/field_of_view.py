"""The focal length of a take against those of lenses: millimetres given as pixels are none.

Rectilinear lenses for a sensor 36 mm wide have 10 to 1200 mm: 0.28 to 33 times its width.
"""

from pathlib import Path

import numpy as np

from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["report_field_of_view"]

_WIDEST, _LONGEST = 0.25, 40.0  # of the image's longer side
_SENSOR = 36.0  # [mm] width of the sensor that focal lengths are mostly told for
_LENSES = (4.0, 1200.0)  # [mm] focal lengths that are written on lenses, phones' too


def report_field_of_view(take: MarkerTake | WeightsTake, path: Path) -> list[Finding]:
    """Return FOCAL_LENGTH_UNUSUAL where no lens has the field of view of a take.

    Parameters
    ----------
    take : MarkerTake or WeightsTake
        Of a film whose focal length and size are known; others are none.
    path : Path
        The file that the message names.
    """
    if isinstance(take, WeightsTake) or not take.focal_length or not take.image_size:
        return []
    focal, side = take.focal_length, max(take.image_size)
    if _WIDEST <= focal / side <= _LONGEST:
        return []
    degrees = float(np.degrees(2.0 * np.arctan2(0.5 * side, focal)))
    message = (
        "{focal_length_px:g} px is a field of view of {field_degrees:.3g} degrees, which no lens "
        "has; --focal-length is in pixels: that of the lens [mm] / the sensor's width [mm] * the "
        "image's width [px]{hint}"
    )
    hint = ""
    if focal < side and _LENSES[0] <= focal <= _LENSES[1]:
        hint = f" ({focal:g} mm on a sensor of {_SENSOR:g} mm: {focal / _SENSOR * side:.0f} px)"
    return [finding("FOCAL_LENGTH_UNUSUAL", str(path), message, focal, degrees, Prose(hint))]
