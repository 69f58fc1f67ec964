"""The gaze that a recorder saw beside the markers, as pins of a rig's blend shapes of gaze."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.curve_mapping import rename_weights, undecided
from usdface.face.curves_by_unit import curves_by_unit
from usdface.face.gaze_curves import GAZE_CURVES, gaze_weights
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["gaze_pins", "gaze_shapes", "recorded_gaze"]

# Eyes that blink this far show no gaze; open ones have up to 0.14 in a recording. By hand.
_BLINKING = 0.15
# Eyes that are not seen for this long [s] looked where they do before and after, as in a blink, of
# which the longest is 0.5 s (Stern, Walrath, Goldstein, "The endogenous eyeblink", 1984).
_BRIDGED = 0.6


def recorded_gaze(take: MarkerTake, setup: RetargetSetup) -> FloatArray | None:
    """Return yaw and pitch (F, 2) [rad] of the eyes from the neutral; None if not recorded.

    In the neutral frames the performer looks straight ahead, as the character does; a neutral of
    the rig leaves the angles as they are. NaN where no eyes are seen, but for a blink.
    """
    if take.gaze is None or setup.solve.gaze != "recorded":
        return None
    gaze = take.gaze.copy()
    if take.blink is not None:
        gaze[take.blink > _BLINKING] = np.nan
    seen = ~np.isnan(gaze[:, 0])
    if not seen.any():
        return None
    if setup.neutral is not None:
        first, last = setup.neutral
        ahead = gaze[first : last + 1][seen[first : last + 1]]
        gaze -= np.median(ahead if len(ahead) else gaze[seen], axis=0)
    return _bridged(take.times, gaze, seen)


def _bridged(times: FloatArray, gaze: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the gaze (F, 2) with short gaps closed."""
    frames = np.flatnonzero(seen)
    after = np.searchsorted(frames, np.arange(len(times))).clip(1, len(frames) - 1)
    gap = times[frames[after]] - times[frames[after - 1]] if len(frames) > 1 else np.inf
    inside = (np.arange(len(times)) > frames[0]) & (np.arange(len(times)) < frames[-1])
    short = inside & (gap <= _BRIDGED)
    result = gaze.copy()
    for axis in range(2):
        curve = np.interp(times, times[seen], gaze[seen, axis])
        result[short, axis] = curve[short]
    return result


def gaze_shapes(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the blend shapes of gaze among those of a rig, in any naming convention."""
    idle = undecided(GAZE_CURVES, names, _driven_shapes(names))[1]
    return tuple(name for name in names if name not in idle)


def gaze_pins(take: MarkerTake, names: tuple[str, ...], setup: RetargetSetup) -> tuple[Pin, ...]:
    """Return pins of a rig's blend shapes of gaze in the frames in which a recorder saw the eyes.

    Parameters
    ----------
    take : MarkerTake
    names : tuple of str
        The rig's blend shapes.
    setup : RetargetSetup
        Its own pins come first.
    """
    angles, shapes = recorded_gaze(take, setup), gaze_shapes(names)
    if angles is None or not shapes:
        return ()
    frames = np.flatnonzero(~np.isnan(angles[:, 0]))
    curves = WeightsTake(GAZE_CURVES, take.times[frames], gaze_weights(angles[frames]))
    weights, _ = rename_weights(curves, names, _driven_shapes(names))
    pinned = {pin.shape for pin in setup.pins}
    return tuple(Pin(name, frames, weights.column(name)) for name in shapes if name not in pinned)


def _driven_shapes(names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Return the blend shapes of another naming convention that the curves of gaze drive."""
    return curves_by_unit(*undecided(GAZE_CURVES, names, {}))
