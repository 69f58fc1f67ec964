"""The measures of a verdict that ask whether there is a performance, and whether it is shown."""

import re

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.curve_mapping import undecided
from usdface.face.gaze_curves import gaze_curves_of
from usdface.face.plain_names import shape_keys
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake
from usdface.verdict.judge import Measured

__all__ = ["STILL", "idle_curves", "performance_short", "still_markers", "still_weights"]

# Motion of a face that moves, as a share of the RMS radius of its markers (0.06 mm of ICT's): of a
# still one, all is rounding. Set by hand.
STILL = 1e-3
# [s] A take of less than half of it holds no expression that comes and goes. Set by hand: the
# longest blink lasts 0.6 s.
_SECOND = 1.0
_NAMED = 4  # curves that a reason names
# Of a weight that moves, as little as its marker would. Set by hand.
_STILL_WEIGHT = 1e-3
# Angles of head and eyes beside the weights, as Live Link and others name them.
_ROTATION = re.compile(r"(head|(left|right)?eyes?)(rotation|rot)?(yaw|pitch|roll)(left|right)?")
# Of the usual peak of curves, and of 1: values beyond are no weights, as degrees. Set by hand.
_FAR = 3.0


def performance_short(times: FloatArray) -> Measured:
    """Return the share of a second by which a take is shorter; `times` (F,) [s]."""
    count, lasts = len(times), float(times[-1] - times[0]) if len(times) else 0.0
    text = "1 frame" if count == 1 else f"{count} frames, {lasts:.2g} s"
    return Measured(max(0.0, 1.0 - lasts / _SECOND), "length", (text,))


def still_markers(motion: float, radius: float) -> Measured:
    """Return the share of the least motion that is missing.

    Where noise hides a motion, that it is large is the reason (`NOISE_LARGE`).

    Parameters
    ----------
    motion : float [m]
        RMS displacement of the markers, noise included.
    radius : float [m]
        RMS radius of the resting markers.
    """
    least = STILL * radius
    return Measured(max(0.0, 1.0 - motion / least) if least else np.nan)


def still_weights(take: WeightsTake) -> Measured:
    """Return the same of a take of weights, by the one that moves most."""
    if not take.weights.size:
        return Measured(np.nan)
    return Measured(max(0.0, 1.0 - float(np.ptp(take.weights, axis=0).max()) / _STILL_WEIGHT))


def idle_curves(take: WeightsTake, rig_shapes: tuple[str, ...], setup: RetargetSetup) -> Measured:
    """Return the share of the RMS motion of all curves that moves no blend shape.

    Curves of gaze count for nothing: joints may turn the eyes. Neither do angles of head and eyes,
    nor curves that the setup names as driving nothing.
    """
    idle, _ = undecided(take.names, rig_shapes, setup.curves)
    counted = _of_face(take)
    lost = np.isin(take.names, idle) & counted
    motion = take.weights.var(axis=0) if len(take.weights) else np.zeros(len(take.names))
    whole = float(motion[counted].sum())
    if not whole:
        return Measured(np.nan)
    most = [take.names[i] for i in np.argsort(-motion * lost, kind="stable") if lost[i]]
    share = float(np.sqrt(motion[lost].sum() / whole))
    return Measured(share, "curves", tuple(most[:_NAMED]))


def _of_face(take: WeightsTake) -> BoolArray:
    """Return the curves (S,) that are weights of a face, but for its gaze."""
    pairs, gaze = zip(take.names, shape_keys(take.names), strict=True), gaze_curves_of(take.names)
    named = [name in gaze or _ROTATION.fullmatch(base) for name, (base, _) in pairs]
    peaks = np.abs(take.weights).max(axis=0, initial=0.0)
    moving = peaks[np.ptp(take.weights, axis=0) > 0] if len(take.weights) else peaks
    usual = float(np.quantile(moving, 0.5, method="lower")) if len(moving) else 0.0
    return np.asarray(~np.array(named, dtype=bool) & (peaks <= _FAR * max(1.0, usual)))
