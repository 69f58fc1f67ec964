"""Noise of marker features after the solve, and motions that exceed it."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.options import SolveOptions

__all__ = ["exceeds_noise", "solved_noise"]

# Numerical guard [m], for features without noise: far below the resolution of any marker.
_LEAST_MOTION = 1e-6


def solved_noise(basis: FloatArray, features: FloatArray, noise: float) -> FloatArray:
    """Return the standard deviation of each feature after the solve: (I,) [m].

    The weights' covariance is that of ridge regression on the markers, for every frame alone.

    Parameters
    ----------
    basis, features : (S, I) float64 [m]
        Displacements as they are and relative to the nose tip.
    noise : float [m]
    """
    ridge = (noise / SolveOptions().spread) ** 2 * np.eye(len(basis))
    inverse = np.linalg.pinv(basis @ basis.T + ridge, hermitian=True)
    variance = np.einsum("si,st,ti->i", features, inverse, features, optimize=True)
    return np.asarray(noise * np.sqrt(np.maximum(variance, 0.0)))


def exceeds_noise(motion: FloatArray, noise: FloatArray, signal: float) -> BoolArray:
    """Return where features move by more than `signal` times their noise: (I,) bool.

    Parameters
    ----------
    motion, noise : (I,) float64 [m]
    signal : float
    """
    return np.asarray(motion > np.maximum(signal * noise, _LEAST_MOTION))
