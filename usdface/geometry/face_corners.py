"""The corners of faces, in their order around each face."""

import numpy as np

from usdface.arrays import IntArray

__all__ = ["next_corners"]


def next_corners(face_counts: IntArray) -> IntArray:
    """Return the corner that follows each one around its face: (C,) int64.

    Parameters
    ----------
    face_counts : (P,) int64
        Corners of each face.
    """
    ends = np.cumsum(face_counts)
    following = np.arange(1, int(face_counts.sum()) + 1)
    full = face_counts > 0
    following[ends[full] - 1] = (ends - face_counts)[full]
    return following
