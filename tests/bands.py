"""Banded matrices of the solve, written out."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["dense"]


def dense(bands: FloatArray) -> FloatArray:
    """Return the symmetric matrix (F, F) of its upper bands (3, F)."""
    matrix = np.diag(bands[2])
    for k in (1, 2):
        matrix += np.diag(bands[2 - k, k:], k) + np.diag(bands[2 - k, k:], -k)
    return matrix
