"""The error that is left where a performer's strengths are not known, and nothing else is wrong.

Markers show the product of strength and weight alone. A solver that finds every product exactly,
and takes it for the weight, is off by the strengths; one that also knows the largest product of
each shape in another take, which says that the strength is that or more, by a little less.
"""

import numpy as np

from benchmarks.performers.worlds import OTHER_TAKE, SCORED, strengths_of
from benchmarks.solve.faces import Face
from usdface.arrays import FloatArray
from usdface.retarget.amplitude_posterior import amplitude_posterior

__all__ = ["errors_by_strength"]

# Held for 0.1 s at 30 Hz, as `usdface calibrate` asks for; and the deviation of a weight.
_HELD, _DEVIATION = 4, 0.02


def errors_by_strength(face: Face, number: int) -> tuple[FloatArray, FloatArray]:
    """Return the errors (F, S) of exact products as weights, and with the peaks of another take."""
    truth = face.curves[SCORED]
    strengths = strengths_of(number, truth.shape[1])
    peaks = np.sort(face.curves[OTHER_TAKE], axis=0)[-_HELD] * strengths
    amplitudes, _ = amplitude_posterior(peaks, np.full(len(peaks), _DEVIATION), 0.0)
    products = truth * strengths
    return products.clip(0, 1) - truth, (products / amplitudes).clip(0, 1) - truth
