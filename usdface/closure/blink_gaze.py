"""Gaze during blinks: eyes look no further than before and after.

A blink and a glance, down most of all, move the same markers, so the solve mixes the two. During a
detected blink the markers carry no information on the gaze.
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.eye_closing import EyeClosing
from usdface.face.expression_poses import units_of
from usdface.face.gaze_curves import GAZE_UNITS

__all__ = ["without_glances"]


def without_glances(
    weights: FloatArray,
    times: FloatArray,
    names: tuple[str, ...],
    closings: Sequence[EyeClosing],
    near_pins: FloatArray,
) -> FloatArray:
    """Return weights that look away in a blink at most as interpolated from before to after it.

    Parameters
    ----------
    weights : (F, T) float64
        Of the blend shapes `names`.
    times : (F,) float64 [s]
    names : tuple of str, length T
    closings : sequence of EyeClosing
        Only blinks limit the gaze: eyes that are held shut may look anywhere.
    near_pins : (F, T) float64
        `usdface.retarget.pins.pin_nearness`: pinned weights stay.

    Returns
    -------
    (F, T) float64
    """
    units = units_of(names)
    gaze = [t for t, name in enumerate(names) if units.get(name, frozenset()) & {*GAZE_UNITS}]
    steady = weights.copy()
    for blink in closings:
        if blink.kind != "blink":
            continue
        first, last = np.searchsorted(times, [blink.start, blink.end]).tolist()
        first, last = max(first - 1, 0), min(last, len(times) - 1)
        own = slice(first, last + 1)
        share = (times[own] - times[first]) / max(times[last] - times[first], 1e-9)
        level = np.outer(1.0 - share, weights[first, gaze]) + np.outer(share, weights[last, gaze])
        steady[own, gaze] = np.minimum(steady[own, gaze], level)
    return np.asarray(steady + near_pins * (weights - steady))
