"""Events: stretches of a take in which an emotion is shown, and how far it is held in each frame.

A correction that follows the output frame by frame jumps wherever the output does. So an event is
taken as a whole: its size is decided once, and a pose that is held gets a correction that is held.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from usdface.arrays import BoolArray, FloatArray

__all__ = ["Event", "events_of", "frame_events"]

# Shares of the onset at which an event is over (a Schmitt trigger: O. Schmitt, "A thermionic
# trigger", 1938), and of the size of an event from which it counts as held, tuned by
# benchmarks/expression_takes.py.
_RELEASE = 0.5
_HELD = 0.6
# Ups and downs of less than this share of the size are noise: an expression that rises, rises.
_PLAY = 0.06
# Frames in which the output reaches this share of the size are the peak of an event.
_PEAK = 0.85


@dataclass(frozen=True, eq=False, slots=True)
class Event:
    """One stretch of a take in which an emotion is shown.

    Attributes
    ----------
    frames : slice
    size : float
        The largest output.
    envelope : (N,) float64
        0 at either end, 1 where it is held; rises and falls as the output does, on its way up and
        down without turning back.
    peak : (N,) bool
        The frames that evidence is taken from.
    """

    frames: slice
    size: float
    envelope: FloatArray
    peak: BoolArray


def events_of(output: FloatArray, onset: float) -> list[Event]:
    """Return the events of a curve (F,).

    They reach the onset, and last as long as the curve is above half of it.
    """
    release = _RELEASE * onset
    labels, count = label(output > release)
    found = []
    for number in range(1, count + 1):
        at = np.flatnonzero(labels == number)
        own = output[at]
        size = float(own.max())
        if size > onset:
            frames = slice(int(at[0]), int(at[-1]) + 1)
            held = max(_HELD * size, release + 1e-9)
            settled = _settled(own, _PLAY * size)
            envelope = _monotone_ends(_smooth_step((settled - release) / (held - release)))
            found.append(Event(frames, size, envelope, own >= _PEAK * size))
    return found


def frame_events(output: FloatArray, onset: float) -> list[Event]:
    """Return each frame of a curve (F,) above the onset as an event of its own."""
    one = np.ones(1)
    return [
        Event(slice(f, f + 1), float(output[f]), one, one > 0)
        for f in np.flatnonzero(output > onset).tolist()
    ]


def _settled(curve: FloatArray, play: float) -> FloatArray:
    """Return a curve (N,) without its ups and downs of less than twice `play`: hysteresis.

    The mean of a forward and a backward pass, so that it does not lag.
    """
    passes = []
    for course in (curve, curve[::-1]):
        at, settled = float(course[0]), np.empty(len(course))
        for k, value in enumerate(course.tolist()):
            at = min(max(at, value - play), value + play)
            settled[k] = at
        passes.append(settled)
    return np.asarray((passes[0] + passes[1][::-1]) / 2)


def _monotone_ends(envelope: FloatArray) -> FloatArray:
    """Return an envelope (N,) that rises until it is first held and falls after it last is."""
    held = np.flatnonzero(envelope >= envelope.max())
    ends = envelope.copy()
    ends[: held[0]] = _rising(envelope[: held[0]])
    ends[held[-1] + 1 :] = _rising(envelope[held[-1] + 1 :][::-1])[::-1]
    return ends


def _rising(curve: FloatArray) -> FloatArray:
    """Return the mean of the least rising curve above a curve (N,) and the largest below it."""
    above = np.maximum.accumulate(curve)
    below = np.minimum.accumulate(curve[::-1])[::-1]
    return np.asarray((above + below) / 2)


def _smooth_step(x: FloatArray) -> FloatArray:
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
