"""The size of movements that go beyond the character's, from the take itself.

A blend shape ends at weight 1. Where the performer goes further, the peak is cut off, and other
shapes are pulled in to make up for it. Markers show the product of the movement's amplitude and a
weight of at most 1, so that a peak beyond 1 says that the amplitude is that or more.
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.options import AMPLITUDE_RANGE
from usdface.retarget.amplitude_posterior import amplitude_posterior

__all__ = ["take_amplitudes"]

# A peak is sure to be beyond 1 by so many of its standard deviations: not at all, and wholly. On
# performers 1 to 4 of python -m benchmarks.performers the skin is off by 0.497 mm where strengths
# differ and by 0.211 mm where they do not; by 2 and 4 0.517, 0.211; without gains 0.560, 0.212.
_BEYOND = (1.0, 3.0)
# A gain that is nearer to 1 changes nothing that is seen, and costs a solve.
_LEAST = 0.01
# Least deviation: the posterior's grid has steps of 0.005.
_FINEST = 0.005


def take_amplitudes(peaks: FloatArray, deviations: FloatArray) -> FloatArray:
    """Return how large each movement is against the character's: (S,), 1 or more.

    Parameters
    ----------
    peaks : (S,) float64
        How far each weight goes up where nothing bounds it.
    deviations : (S,) float64
        Their standard deviation, by noise and misfit.

    Returns
    -------
    (S,) float64
        Exactly 1 where the peak may as well be 1.
    """
    deviations = np.maximum(deviations, _FINEST)
    most, _ = amplitude_posterior(peaks, deviations, 0.0)
    low, high = _BEYOND
    sure = np.clip(((peaks - 1.0) / deviations - low) / (high - low), 0.0, 1.0)
    sure = sure * sure * (3.0 - 2.0 * sure)
    gains = (1.0 + sure * (most - 1.0)).clip(1.0, AMPLITUDE_RANGE[1])
    return np.where(gains < 1.0 + _LEAST, 1.0, gains)
