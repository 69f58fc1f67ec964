"""Rotations into the space of a camera that looks at a face."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["view_rotation"]


def view_rotation(yaw: float, pitch: float) -> FloatArray:
    """Return the rotation (3, 3) from world to camera space, for column vectors.

    Parameters
    ----------
    yaw, pitch : float [degree]
        Where the camera stands: yaw 0 in front (+Z), positive to +X; pitch positive above. In its
        space x is right, y up and z towards it.
    """
    y, p = np.radians([yaw, pitch])
    turn = np.array([[np.cos(y), 0, -np.sin(y)], [0, 1, 0], [np.sin(y), 0, np.cos(y)]])
    tilt = np.array([[1, 0, 0], [0, np.cos(p), -np.sin(p)], [0, np.sin(p), np.cos(p)]])
    return np.asarray(tilt @ turn)
