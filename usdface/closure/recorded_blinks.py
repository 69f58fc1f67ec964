"""Blinks that a recorder saw by itself, such as OpenFace in action unit 45.

Its landmarks follow closing lids in part or not at all, as its face model has few shapes for them;
the action unit is read from the image around the eyes (T. Baltrušaitis, M. Mahmoud, P. Robinson,
"Cross-dataset learning and person-specific normalisation for automatic Action Unit detection",
Facial Expression Recognition and Analysis, 2015).
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.cleanup.blink_motion import LEAST_BLINK
from usdface.closure.blinks import find_blinks
from usdface.closure.even_times import even_times
from usdface.closure.eye_closing import EyeClosing, in_frames
from usdface.closure.lid_pulses import APART, lid_pulses
from usdface.numerics.local_maxima import local_maxima

__all__ = ["recorded_blinks", "unseen_blinks"]

# A pulse as high as this, the intensity A of FACS, is whole, however much higher others are.
_WHOLE = 0.2


def recorded_blinks(times: FloatArray, blink: FloatArray) -> list[EyeClosing]:
    """Return the blinks of both eyes that a recorder saw, in order of time.

    Parameters
    ----------
    times : (F,) float64 [s]
    blink : (F,) float64
        `usdface.takes.MarkerTake.blink`; between frames without a face it is interpolated.
    """
    seen = np.flatnonzero(np.isfinite(blink))
    if len(times) < 3 or not len(seen):
        return []
    even = even_times(times)
    step = even.step
    _, pulses, floor = lid_pulses(np.interp(even.times, times[seen], blink[seen]), step)
    pulses = np.where(pulses < floor, 0.0, pulses)
    heights = pulses[local_maxima(pulses, LEAST_BLINK, max(int(APART / step), 1))]
    if not len(heights):
        return []
    both = np.repeat(pulses[:, None], 2, axis=1)
    scale = np.full(2, min(float(np.median(heights)), _WHOLE))
    least = np.full(2, LEAST_BLINK)
    nowhere = np.zeros(both.shape, dtype=bool)
    found, _ = find_blinks(even.times, both, nowhere, scale, least)
    return [in_frames(each, even) for each in found]


def unseen_blinks(
    recorded: Sequence[EyeClosing], closings: Sequence[EyeClosing]
) -> list[EyeClosing]:
    """Return the recorded blinks in which the markers show no closing of either eye."""
    return [
        each
        for each in recorded
        if all(other.end <= each.start or each.end <= other.start for other in closings)
    ]
