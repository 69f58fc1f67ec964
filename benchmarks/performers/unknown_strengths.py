"""The error that is left where a performer's strengths are not known, and nothing else is wrong.

Markers show the product of strength and weight alone. A solver that finds every product exactly,
and takes it for the weight, is off by the strengths. The largest product of each shape, in the take
itself or in another one, says that the strength is that or more: with it a little less is left.
"""

import numpy as np

from benchmarks.performers.worlds import OTHER_TAKE, SCORED, strengths_of
from benchmarks.solve.faces import Face
from usdface.arrays import FloatArray
from usdface.retarget.amplitude_posterior import amplitude_posterior

__all__ = ["errors_by_strength"]

# Held for 0.1 s at 30 Hz, as `usdface calibrate` asks for; and the deviation of a weight.
_HELD, _DEVIATION = 4, 0.02


def errors_by_strength(face: Face, number: int) -> dict[str, FloatArray]:
    """Return the errors (F, S) of exact products as weights, and with the peaks of takes."""
    truth = face.curves[SCORED]
    strengths = strengths_of(number, truth.shape[1])
    products = truth * strengths
    errors = {"every product exact": products.clip(0, 1) - truth}
    for name, part in (("the take's own", SCORED), ("another take's", OTHER_TAKE)):
        peaks = np.sort(face.curves[part], axis=0)[-_HELD] * strengths
        amplitudes, _ = amplitude_posterior(peaks, np.full(len(peaks), _DEVIATION), 0.0)
        errors[f"and {name} peaks"] = (products / amplitudes).clip(0, 1) - truth
    return errors
