"""Motion gain: how much further the performer's markers move than the solved face.

A solve shrinks motion that the rig's blend shapes do not explain well: markers sit a few
millimetres off, or another person's mouth opens differently. An expression is then detected too
weakly. So each half of the face moves in the direction of the solve, as far as its markers.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from usdface.arrays import BoolArray, FloatArray

__all__ = ["LEAST_MOTION", "motion_gains", "motion_products"]

# RMS displacement of a marker on a human face [m] at which the markers' own size counts by a half:
# less is noise. Largest gain. Set by benchmarks/expression_takes.py.
LEAST_MOTION = 0.0005
_MOST = 1.5


def motion_products(
    solved: FloatArray, recorded: FloatArray, upper: BoolArray, measured: BoolArray
) -> FloatArray:
    """Return mean products of motion: (F, 2, 2) [m^2].

    Of the lower and the upper half: solved times recorded motion, and solved motion squared; 0 of a
    half that is not measured.

    Parameters
    ----------
    solved, recorded : (F, M, 3) float64 [m]
        Displacements against the nose tip, of the character as solved and of the markers mapped
        over to it.
    upper : (M,) bool
        Markers of the upper half.
    measured : (M,) bool
        Markers that the gain is taken from.
    """
    products = np.zeros((len(solved), 2, 2))
    for half, own in enumerate((~upper & measured, upper & measured)):
        if own.any():
            at = solved[:, own]
            products[:, half, 0] = np.einsum("fmk,fmk->f", at, recorded[:, own]) / own.sum()
            products[:, half, 1] = np.einsum("fmk,fmk->f", at, at) / own.sum()
    return products


def motion_gains(products: FloatArray, frames: float, size: float = 1.0) -> FloatArray:
    """Return by how much markers move further than solved: (F, 2), of the lower and upper half.

    The gain of the least squares from solved to recorded motion; 1 where hardly anything moves, and
    never less than 1.

    Parameters
    ----------
    products : (F, 2, 2) float64 [m^2]
        From `motion_products`.
    frames : float
        Standard deviation of the Gaussian that smooths the gain over time.
    size : float
        Of the face, in human ones.
    """
    if frames > 0:
        products = gaussian_filter1d(products, frames, axis=0, mode="nearest")
    counts = (size * LEAST_MOTION) ** 2
    gain = (products[..., 0] + counts) / (products[..., 1] + counts)
    return np.asarray(np.clip(gain, 1.0, _MOST))
