"""The error that is left where a performer's strengths are not known, and nothing else is wrong.

Markers show the product of strength and weight alone. A solver that finds every product exactly,
and takes it for the weight, is off by the strengths. The largest product of each shape, in the take
itself or in another one, says that the strength is that or more: with it a little less is left.
Nor does it help to know the distribution that the strengths were drawn from. Most of what is left
is the jaw's, whose strength a file can only know if the performer's jaw is known to have been wide
open.
"""

import numpy as np

from benchmarks.performers.worlds import OTHER_TAKE, SCORED, strengths_of
from benchmarks.solve.faces import Face
from usdface.arrays import FloatArray
from usdface.options import EXTREME_REACHED
from usdface.retarget.gain_posterior import gain_posterior

__all__ = ["errors_by_strength"]

# Held for 0.1 s at 30 Hz, as `usdface calibrate` asks for; and the deviation of a weight.
_HELD, _DEVIATION = 4, 0.02
_SMILES = ("mouthSmile_L", "mouthSmile_R")
_GIVEN = {"jaw": ("jawOpen",), "jaw and smiles": ("jawOpen", *_SMILES)}


def errors_by_strength(face: Face, number: int) -> dict[str, FloatArray]:
    """Return the errors (F, S) of exact products as weights, and with the peaks of takes."""
    truth = face.curves[SCORED]
    strengths = strengths_of(number, truth.shape[1])
    products = truth * strengths
    errors = {"every product exact": products.clip(0, 1) - truth}
    named = {name: np.isin(face.mesh.shape_names, shapes) for name, shapes in _GIVEN.items()}
    for name, part in (("the take's own", SCORED), ("another take's", OTHER_TAKE)):
        gains = _gains(face, part, strengths, 0.0)
        errors[f"and {name} peaks"] = (products / gains).clip(0, 1) - truth
    wide = np.where(named["jaw"], _gains(face, OTHER_TAKE, strengths, EXTREME_REACHED), gains)
    errors["and its jaw wide open"] = (products / wide).clip(0, 1) - truth
    peaks = np.maximum(_peaks(face, SCORED), _peaks(face, OTHER_TAKE)) * strengths
    errors["both peaks, strengths' distribution"] = (products * _inverse(peaks)).clip(0, 1) - truth
    for name, given in named.items():
        some = np.where(given, strengths, gains)
        errors[f"another take's peaks, {name} given"] = (products / some).clip(0, 1) - truth
    return errors


def _peaks(face: Face, part: slice) -> FloatArray:
    return np.asarray(np.sort(face.curves[part], axis=0)[-_HELD])


def _gains(face: Face, part: slice, strengths: FloatArray, reached: float) -> FloatArray:
    peaks = _peaks(face, part) * strengths
    return gain_posterior(peaks, np.full(len(peaks), _DEVIATION), reached)[0]


def _inverse(peaks: FloatArray) -> FloatArray:
    """Return the mean of 1 / strength, uniform between 0.8 and 1.25 and at least the peak."""
    low, high = peaks.clip(0.8, 1.2499), 1.25
    return np.asarray(np.log(high / low) / (high - low))
