"""Shown motion: how far the performer's markers move, in the direction that the solve found.

A solve shrinks motion that the rig's blend shapes do not explain well, as where markers sit a few
millimetres off or another person's mouth opens otherwise. An expression then is heard too weak. The
solve says which way each half of the face moves, the markers how far.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from usdface.arrays import BoolArray, FloatArray

__all__ = ["motion_gains"]

# RMS displacement of a marker [m] at which the markers' own size counts by a half: less is noise.
# Largest gain. Set by benchmarks/expression_takes.py.
_COUNTS = 0.0005
_MOST = 1.5


def motion_gains(
    solved: FloatArray, shown: FloatArray, upper: BoolArray, measured: BoolArray, frames: float
) -> FloatArray:
    """Return by how much markers move further than solved: (F, M).

    Either half of the face has a gain of its own in each frame, that of the least squares from
    `solved` to `shown`; 1 where hardly anything moves, and never less than 1.

    Parameters
    ----------
    solved, shown : (F, M, 3) float64 [m]
        Displacements against the nose tip, of the character as solved and of the markers carried
        over to it.
    upper : (M,) bool
        Markers of the upper half.
    measured : (M,) bool
        Markers that the gain is taken from.
    frames : float
        Standard deviation of the Gaussian that smooths the gain over time.
    """
    gains = np.ones(solved.shape[:2])
    for half in (upper, ~upper):
        own = half & measured
        if not own.any():
            continue
        common = np.einsum("fmk,fmk->f", solved[:, own], shown[:, own]) / own.sum()
        square = np.einsum("fmk,fmk->f", solved[:, own], solved[:, own]) / own.sum()
        if frames > 0:
            common, square = (
                gaussian_filter1d(values, frames, mode="nearest") for values in (common, square)
            )
        gain = (common + _COUNTS**2) / (square + _COUNTS**2)
        gains[:, half] = np.clip(gain, 1.0, _MOST)[:, None]
    return gains
