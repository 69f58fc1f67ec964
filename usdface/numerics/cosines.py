"""Cosines between vectors."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["cosines"]


def cosines(vectors: FloatArray, other: FloatArray) -> FloatArray:
    """Return the cosines between vectors (N, D) and another one (D,), 0 where one is 0: (N,)."""
    lengths = np.linalg.norm(vectors, axis=1) * np.linalg.norm(other)
    dots = vectors @ other
    return np.asarray(np.divide(dots, lengths, out=np.zeros(len(dots)), where=lengths > 0))
