"""Gaze as blend shape weights, ARKit's eyeLook, and as angles of the eyes."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.facs_names import NAMING_CONVENTIONS, ActionUnit
from usdface.face.plain_names import shape_keys
from usdface.face.shape_names import shape_key

__all__ = [
    "GAZE_CURVES",
    "GAZE_UNITS",
    "Side",
    "gaze_angles",
    "gaze_curves_of",
    "gaze_shapes_of",
    "gaze_weights",
]

Side = Literal["left", "right"]

# Action units of eyes that turn left, right, up and down.
GAZE_UNITS = (61, 62, 63, 64)

# Angle of an eye at weight 1 [rad]. In a phone's recorded range of motion (Live Link Face, 4,030
# frames) the eyes' angles are these times the weights, R^2 0.9995 and more for each of four: fits
# 36.2 and 35.7 (in), 33.1 and 33.4 (out), 25.3 and 25.4 (up), 35.0 and 34.8 degrees (down).
_ANGLES = {
    "eyelookin": np.radians(36.0),
    "eyelookout": np.radians(33.0),
    "eyelookup": np.radians(25.0),
    "eyelookdown": np.radians(35.0),
}


GAZE_CURVES = tuple(
    f"eyeLook{way}{side}" for side in ("Left", "Right") for way in ("In", "Out", "Up", "Down")
)


def gaze_curves_of(names: Sequence[str]) -> frozenset[str]:
    """Return the curves of a take that are a gaze that `gaze_angles` reads, in any spelling."""
    pairs = zip(names, shape_keys(names), strict=True)
    return frozenset(name for name, (base, side) in pairs if base in _ANGLES and side)


def gaze_shapes_of(names: Sequence[str]) -> frozenset[str]:
    """Return the blend shapes of a rig that are a gaze in a known naming convention."""
    pairs = zip(names, shape_keys(names), strict=True)
    return frozenset(name for name, key in pairs if key in _GAZE_SHAPES)


def gaze_angles(names: tuple[str, ...], weights: FloatArray) -> dict[Side, FloatArray]:
    """Return yaw and pitch (F, 2) [rad] of each eye that has gaze curves.

    Parameters
    ----------
    names : tuple of str, length S
    weights : (F, S) float64 [1]

    Returns
    -------
    dict of "left", "right" to (F, 2) float64
        Yaw is positive to the face's own left, pitch up.
    """
    columns = {key: i for i, key in reversed(list(enumerate(shape_keys(names))))}
    nothing = np.zeros(len(weights))

    def angle(direction: str, side: Side) -> FloatArray:
        column = columns.get((direction, side))
        return nothing if column is None else _ANGLES[direction] * weights[:, column]

    found: dict[Side, FloatArray] = {}
    sides: tuple[tuple[Side, float], ...] = (("left", 1.0), ("right", -1.0))
    for side, outwards in sides:
        if any((direction, side) in columns for direction in _ANGLES):
            yaw = outwards * (angle("eyelookout", side) - angle("eyelookin", side))
            pitch = angle("eyelookup", side) - angle("eyelookdown", side)
            found[side] = np.stack([yaw, pitch], axis=1)
    return found


def gaze_weights(angles: FloatArray) -> FloatArray:
    """Return the weights of `GAZE_CURVES` (F, 8) for yaw and pitch (F, 2) [rad] of both eyes.

    Yaw is positive to the face's own left, pitch up. Weights are clipped to [0, 1].
    """
    yaw, pitch = angles.T
    ways = {
        "Left": (-yaw, yaw, pitch, -pitch),
        "Right": (yaw, -yaw, pitch, -pitch),
    }
    turns = np.stack([*ways["Left"], *ways["Right"]], axis=1)
    return np.asarray((turns / np.tile(list(_ANGLES.values()), 2)).clip(0.0, 1.0))


_GAZE_SHAPES = frozenset(
    shape_key(name)
    for convention in NAMING_CONVENTIONS
    for unit in GAZE_UNITS
    for name, _ in convention.names(ActionUnit(unit))
)
