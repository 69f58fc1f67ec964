"""Units of length and up axes of files, and the way to metres, Y up.

Row vectors throughout, as in USD: ``points @ matrix``.
"""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["METERS_PER_UNIT", "in_metres", "to_metres"]

# An inch is 25.4 mm by definition (International yard and pound agreement, 1959).
METERS_PER_UNIT = {
    "mm": 0.001,
    "cm": 0.01,
    "m": 1.0,
    "in": 0.0254,
    "millimeters": 0.001,
    "centimeters": 0.01,
    "meters": 1.0,
    "inches": 0.0254,
}
# Right-handed, a quarter turn about x: up (z) becomes y, ahead (y) becomes -z.
_Z_UP_TO_Y_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])


def to_metres(meters_per_unit: float, up_axis: str) -> FloatArray:
    """Return the matrix (3, 3) from a file's space, `up_axis` Y or Z, to metres, Y up."""
    turn = _Z_UP_TO_Y_UP if up_axis == "Z" else np.eye(3)
    return np.asarray(turn * meters_per_unit)


def in_metres(positions: FloatArray, meters_per_unit: float, up_axis: str) -> FloatArray:
    """Return positions (..., 3) in metres, Y up; NaN and infinity stay in their component.

    The same as ``positions @ to_metres(meters_per_unit, up_axis)`` of finite numbers.
    """
    if up_axis == "Z":
        signs = np.array([meters_per_unit, meters_per_unit, -meters_per_unit])
        return np.asarray(positions[..., [0, 2, 1]] * signs)
    return np.asarray(positions * meters_per_unit)
