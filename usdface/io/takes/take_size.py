"""The size of a take against that of people: wrong units make it 25 times as large, or more.

Measured: half of the markers lie within 0.056 to 0.063 m of their middle on three faces (AnimFace,
the example, 41 and 42 markers), within 0.24 to 0.40 m on four whole bodies (recordings of Optotrak,
Qualisys and Vicon), which may have a face among them. Markers on the lips alone lie within 0.02 m.
Half of that and three times the largest body are allowed. Centimetres read as millimetres are
below; millimetres read as inches or metres beyond; as centimetres they may be a body.
"""

from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import METERS_PER_UNIT
from usdface.takes import visible

__all__ = ["marker_radius", "report_take_size"]

_FACE = 0.06  # [m]
_LEAST, _MOST = 0.01, 1.2  # [m]
_LIKELY = 3.0  # times as large or small as a face is another unit's size at most
_UNITS = ("mm", "cm", "m", "in")
_FEWEST = 4  # markers in a frame: fewer give no head pose, and no size
_FRAMES = 200  # compared


def marker_radius(positions: FloatArray) -> float:
    """Return the radius around their middle that holds half of the markers [m], in most frames.

    Medians throughout, so that markers far off and frames with few of them do not count. NaN where
    no frame shows four markers.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        NaN = occluded.
    """
    shown = np.flatnonzero(visible(positions).sum(axis=1) >= _FEWEST)
    if not len(shown):
        return np.nan
    places = positions[shown[:: max(1, len(shown) // _FRAMES)]]
    away = np.linalg.norm(places - np.nanmedian(places, axis=1, keepdims=True), axis=2)
    return float(np.median(np.nanmedian(away, axis=1)))


def report_take_size(path: Path, positions: FloatArray, unit: float) -> list[Finding]:
    """Return TAKE_SIZE_UNUSUAL where markers (F, M, 3) [m] lie as on no person.

    Parameters
    ----------
    path : Path
        The file that the message names.
    positions : (F, M, 3) float64 [m]
        NaN = occluded.
    unit : float [m]
        The unit that the file was read in.
    """
    size = marker_radius(positions)
    if not size > 0.0 or _LEAST <= size <= _MOST:
        return []
    used = next((name for name in _UNITS if METERS_PER_UNIT[name] == unit), f"{unit:g} m")
    message = (
        "with {unit} as the unit, half of the markers lie within {size_m:.2g} m of their middle; "
        f"on a face within about {_FACE} m. Name the unit: --units"
    )
    sizes = {name: size / unit * METERS_PER_UNIT[name] for name in _UNITS}
    likely = min(_UNITS, key=lambda name: abs(np.log(sizes[name] / _FACE)))
    if 1.0 / _LIKELY <= sizes[likely] / _FACE <= _LIKELY:
        message += f" ({likely} gives {sizes[likely]:.2g} m)"
    return [finding("TAKE_SIZE_UNUSUAL", str(path), message, used, size)]
