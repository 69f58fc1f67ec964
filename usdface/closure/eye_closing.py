"""Closings of the eyes, and their course over time."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.even_times import EvenTimes

__all__ = ["EyeClosing", "closing_course", "in_frames", "nearest_frame"]


@dataclass(frozen=True, slots=True)
class EyeClosing:
    """One closing of an eye, or of both.

    Attributes
    ----------
    kind : {"blink", "held"}
    eyes : tuple of int
        0 = left, 1 = right.
    start, closed, opened, end : float [s]
        Times at which it begins, is closed, begins to open, and is over.
    height : float
        How far the markers show it: of a blink as a share of the character's closed eye, of an eye
        that is held closed as a share of the take's blinks. Of a blink that only the recording
        names its height there (`recorded_blinks`).
    guessed : bool
        The markers show only one of the two eyes closing.
    lids : (F,) float64, optional
        Upper limit of the course over the take, 0 to 1; 1 by default.
    """

    kind: Literal["blink", "held"]
    eyes: tuple[int, ...]
    start: float
    closed: float
    opened: float
    end: float
    height: float
    guessed: bool = False
    lids: FloatArray | None = field(default=None, compare=False, repr=False)


def closing_course(times: FloatArray, closings: Sequence[EyeClosing]) -> FloatArray:
    """Return how far each eye is closed over time: (F, 2), 0 as solved, 1 closed.

    Each closing rises and falls once, as a raised cosine; an eye that is held closed opens in
    between as far as its lids do.
    """
    course = np.zeros((len(times), 2))
    for each in closings:
        own = slice(*np.searchsorted(times, [each.start, each.end]).tolist())  # 0 elsewhere
        rise = _raised_cosine((times[own] - each.start) / max(each.closed - each.start, 1e-9))
        fall = _raised_cosine((each.end - times[own]) / max(each.end - each.opened, 1e-9))
        closed = np.minimum(rise, fall)
        if each.lids is not None:
            closed = np.minimum(closed, each.lids[own])
        for eye in each.eyes:
            course[own, eye] = np.maximum(course[own, eye], closed)
    return course


def in_frames(closing: EyeClosing, even: EvenTimes) -> EyeClosing:
    """Return a closing that was found at even times as one of the take's frames.

    A blink is closed in the frame that is nearest to its peak.
    """
    if even.own:
        return closing
    closed, opened = closing.closed, closing.opened
    if closing.kind == "blink":
        peak = nearest_frame(even.take, (closed + opened) / 2)
        at = float(even.take[peak])
        closed, opened = min(closed, at), max(opened, at)
    lids = None if closing.lids is None else even.of_frames(closing.lids)
    return replace(closing, closed=closed, opened=opened, lids=lids)


def nearest_frame(times: FloatArray, time: float) -> int:
    """Return the frame nearest to a time [s], the earlier of two."""
    after = min(int(np.searchsorted(times, time)), len(times) - 1)
    before = max(after - 1, 0)
    return before if abs(time - times[before]) <= abs(times[after] - time) else after


def _raised_cosine(share: FloatArray) -> FloatArray:
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(share, 0.0, 1.0)))
