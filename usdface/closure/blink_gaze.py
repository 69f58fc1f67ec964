"""Gaze during blinks: eyes do not look down while they are shut.

A blink and a glance down move the same markers, so the solve mixes the two. During a detected blink
the markers carry no information on the gaze.
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.eye_closing import EyeClosing
from usdface.face.expression_poses import units_of

__all__ = ["without_glances"]

# FACS: 64 is eyes that look down.
_DOWN = 64


def without_glances(
    weights: FloatArray,
    times: FloatArray,
    names: tuple[str, ...],
    closings: Sequence[EyeClosing],
    near_pins: FloatArray,
) -> FloatArray:
    """Return weights that look down in a blink at most as interpolated from before to after it.

    Parameters
    ----------
    weights : (F, T) float64
        Of the blend shapes `names`.
    times : (F,) float64 [s]
    names : tuple of str, length T
    closings : sequence of EyeClosing
        Only blinks limit the gaze: eyes that are held shut may look down.
    near_pins : (F, T) float64
        `usdface.retarget.pins.pin_nearness`: pinned weights stay.

    Returns
    -------
    (F, T) float64
    """
    units = units_of(names)
    down = [t for t, name in enumerate(names) if _DOWN in units.get(name, ())]
    steady = weights.copy()
    for blink in closings:
        if blink.kind != "blink":
            continue
        first, last = np.searchsorted(times, [blink.start, blink.end]).tolist()
        first, last = max(first - 1, 0), min(last, len(times) - 1)
        own = slice(first, last + 1)
        share = (times[own] - times[first]) / max(times[last] - times[first], 1e-9)
        level = np.outer(1.0 - share, weights[first, down]) + np.outer(share, weights[last, down])
        steady[own, down] = np.minimum(steady[own, down], level)
    return np.asarray(steady + near_pins * (weights - steady))
