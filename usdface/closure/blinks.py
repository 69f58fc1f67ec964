"""Blinks and closed eyes, recognised by the course of the lids over time.

A blink is a pulse: the lid comes down fast, hardly rests and goes up again. A morphological opening
takes away every pulse that is shorter than a blink can last; the difference (white top-hat) leaves
only pulses, whatever the level that the lids have between them: squints, glances down and raised
brows stay out. The take itself says how high its blinks are. Where the lids stay at the level of
the blinks, the eye is held closed.

How far an eye is closed comes from lids that markers see only in part, in units of the character's
closed eye (`lid_signal`).

Sources of the times: an endogenous blink takes about 100 ms to full closure, hides the view for at
most 300 ms and takes about 100 ms to reopen, together 500 ms (J. Stern, L. Walrath, R. Goldstein,
"The endogenous eyeblink", Psychophysiology 21, 1984). Closing is 40 to 47 % faster than opening
(C. Sforza et al., "Spontaneous blinking in healthy persons", Ophthalmic and Physiological Optics
28, 2008, by optical markers).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d, grey_opening, maximum_filter1d

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.local_maxima import local_maxima

__all__ = ["EyeClosing", "closing_course", "find_closings", "nearest_frame"]

# Longest blink [s], with a margin for the smoothing that recordings come with.
_LONGEST = 0.6
# Standard deviation [s] of the smoothing: a third of the fastest closing; of noisy markers half the
# width of a blink.
_SMOOTHING = (0.02, 0.05)
# Least height of a pulse in deviations of the smoothed noise, of which the opening alone takes two.
_ABOVE_NOISE = 6.0
# Two pulses closer than this [s] are one, and those of two eyes belong together.
_APART = 0.12
# Least height of an eye's blinks, and of those of the eye that shows them better, in closed eyes of
# the character: in a take with less no blink is seen. Those of two real takes: 0.44 to 1.15.
_SEEN, _BETTER_SEEN = 0.15, 0.3
# Pulses, in heights of the take's own blinks: always a blink above the second, never below the
# first; between them the widest step between the heights decides. Of one eye alone only above the
# third.
_DOUBTED, _SURE, _ALONE = 0.35, 0.6, 0.6
# The other eye takes part from this share on.
_SHARED = 0.25
# Spontaneous blinks are of both eyes; a pulse of one eye that is narrower at half its height [s] is
# no wink: the other lid was not seen.
_FAST = 0.2
# A pulse is a squint or a glance if the second half of its closing takes longer [s], or if it is
# wider at half its height. Of 33 recorded blinks, filtered by their recording, 0.04 to 0.10 and
# 0.09 to 0.30; of other pulses 0.11 to 0.29 and more.
_SLOW, _WIDEST = 0.105, 0.35
# Closed at this share of the height of the blinks; open again, or not yet closing, at the second.
_CLOSED, _OPEN = 0.85, 0.35
# ... at this where the other eye is below the second: one eye alone may be a twitch of its cheek.
_CLOSED_ALONE, _CONTRADICTED = 0.95, 0.75
# Of the usual level of an eye that is held closed: below it the eye is closing or opening, even
# where the blinks of the take go no further. Set by hand.
_STILL_CLOSED = 0.8
# Of the way of a lid marker: if less of it is the lid's own, without the skin around it, a lowered
# brow brought it down (AnimFace: blinks 1, a frown 0.15 to 0.3).
_OWN = 0.5
# Shortest time [s] at that level that is no blink.
_HELD = 0.1
# Limits of closing and opening [s] between open and closed: fastest 50 to slowest 150 of a blink
# that closes, twice that where it opens; an eye that is held closed may take its time.
_CLOSING, _OPENING = (0.05, 0.15), (0.08, 0.3)
_SLOWEST = 0.5
# A raised cosine is at 10 and 90 % after these shares of its length.
_TEN, _NINETY = np.arccos(0.8) / np.pi, 1.0 - np.arccos(0.8) / np.pi


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
        that is held closed as a share of the take's blinks.
    guessed : bool
        One of the two eyes was not seen to close.
    """

    kind: Literal["blink", "held"]
    eyes: tuple[int, ...]
    start: float
    closed: float
    opened: float
    end: float
    height: float
    guessed: bool = False


def find_closings(
    times: FloatArray,
    closing: FloatArray,
    own: FloatArray | None = None,
    least: FloatArray | None = None,
) -> list[EyeClosing]:
    """Find blinks and closed eyes.

    Parameters
    ----------
    times : (F,) float64 [s]
    closing : (F, 2) float64
        How far the left and the right eye are closed: 0 as in the neutral frames, 1 as the
        character's closed eye; NaN in all frames of an eye that is not seen.
    own : (F, 2) float64, optional
        The same of the lids by themselves, without the skin around them (`lid_motion`); NaN where
        that is not known. An eye closes where its lid does, not where its brow lowers it.
    least : (2,) float64, optional
        Least height of a pulse that a blink shows; smaller ones are of the skin.

    Returns
    -------
    list of EyeClosing
        In order of time.
    """
    if len(times) < 3:
        return []
    step = float(np.median(np.diff(times)))
    seen = [eye for eye in (0, 1) if np.isfinite(closing[:, eye]).all()]
    smooth, pulses = closing.copy(), np.zeros(closing.shape)
    skin = np.zeros(closing.shape, dtype=bool)
    least = np.zeros(2) if least is None else least
    for eye in seen:
        smooth[:, eye], pulses[:, eye], floor = _pulses(closing[:, eye], step)
        pulses[pulses[:, eye] < floor, eye] = 0.0
        if own is not None and np.isfinite(own[:, eye]).all():
            _, lids, noise = _pulses(own[:, eye], step)
            lids = maximum_filter1d(lids, 2 * round(_APART / step) + 1)
            skin[:, eye] = lids + noise < _OWN * pulses[:, eye]
    scale = np.array([_blink_height(pulses[:, eye], least[eye], step) for eye in (0, 1)])
    if not np.nanmax(scale, initial=0.0) >= _BETTER_SEEN:
        scale[:] = np.nan
    blinks, peaks = _blinks(times, pulses, skin, scale, least)
    if not blinks:
        return []
    # Only blinks say at which level an eye is closed: from rest it is their height or more.
    level = np.where(
        np.isfinite(scale), np.maximum(np.median(smooth[peaks], axis=0), scale), np.nan
    )
    held = _held(times, smooth, level, _by_itself(own, smooth))
    closings = [*blinks, *(each for each in held if not _within(each, blinks))]
    return sorted(closings, key=lambda each: each.closed)


def closing_course(times: FloatArray, closings: Sequence[EyeClosing]) -> FloatArray:
    """Return how far each eye is closed over time: (F, 2), 0 as solved, 1 closed.

    Each closing rises and falls once, as a raised cosine.
    """
    course = np.zeros((len(times), 2))
    for each in closings:
        own = slice(*np.searchsorted(times, [each.start, each.end]).tolist())  # 0 elsewhere
        rise = _raised_cosine((times[own] - each.start) / max(each.closed - each.start, 1e-9))
        fall = _raised_cosine((each.end - times[own]) / max(each.end - each.opened, 1e-9))
        for eye in each.eyes:
            course[own, eye] = np.maximum(course[own, eye], np.minimum(rise, fall))
    return course


def _raised_cosine(share: FloatArray) -> FloatArray:
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(share, 0.0, 1.0)))


def _pulses(closing: FloatArray, step: float) -> tuple[FloatArray, FloatArray, float]:
    """Return the smoothed curve of an eye (F,), its pulses (F,), and how high noise is."""
    smooth, floor = _smoothed(closing, step)
    width = max(round(_LONGEST / step), 3)
    return smooth, smooth - grey_opening(smooth, width, mode="nearest"), floor


def _smoothed(closing: FloatArray, step: float) -> tuple[FloatArray, float]:
    """Return the smoothed curve of an eye, and the least height of a pulse that is no noise."""
    # Third differences of white noise have 20 times its variance; blinks are rare.
    noise = 1.4826 * float(np.median(np.abs(np.diff(closing, 3)))) / np.sqrt(20.0)
    smooth, floor = closing, _ABOVE_NOISE * noise
    for width in _SMOOTHING:
        sigma = width / step
        smooth = gaussian_filter1d(closing, sigma, mode="nearest")
        floor = _ABOVE_NOISE * noise / max(np.sqrt(2.0 * np.sqrt(np.pi) * sigma), 1.0)
        if floor < _SEEN:
            break
    return smooth, floor


def _blink_height(pulses: FloatArray, least: float, step: float) -> float:
    """Return the height of an eye's blinks; NaN if none is seen: all are lower than `least`."""
    peaks = local_maxima(pulses, max(_SEEN, least), max(int(_APART / step), 1))
    if not len(peaks):
        return float("nan")
    heights = np.sort(pulses[peaks])[::-1]
    # The upper quartile: the highest alone may be a squeeze, or noise.
    return float(np.quantile(heights, 0.75))


def _blinks(
    times: FloatArray,
    pulses: FloatArray,
    skin: BoolArray,
    scale: FloatArray,
    least: FloatArray,
) -> tuple[list[EyeClosing], IntArray]:
    """Return the blinks, and the frame of each one's peak.

    Of an eye whose pulse is its skin's, `skin` (F, 2), nothing is seen there.
    """
    step = float(np.median(np.diff(times)))
    known = np.isfinite(scale)
    if not known.any():
        return [], np.zeros(0, np.int64)
    relative = np.where(known, pulses / np.where(known, scale, 1.0), 0.0)
    strongest = relative.max(axis=1)
    peaks = local_maxima(np.pad(strongest, 1), _DOUBTED, max(int(_APART / step), 1)) - 1
    reach, around = round(_APART / step), round(2 * _LONGEST / step)
    shares = np.array([_shares(relative, skin, peak, reach) for peak in peaks]).reshape(-1, 2)
    seen = (shares * np.where(known, scale, 0.0) >= least).any(axis=1)
    peaks, shares = peaks[seen], shares[seen]
    threshold = _threshold(shares.max(axis=1, initial=0.0))
    blinks, kept = [], []
    for peak, share in zip(peaks.tolist(), shares, strict=True):
        both = bool((share >= _SHARED).all())
        if share.max() < (threshold if both or not known.all() else _ALONE):
            continue
        # The mean course of the eyes that show it: they move together.
        shown = np.flatnonzero(share >= _SHARED)
        first, last = max(peak - around, 0), peak + around + 1
        course = (relative[first:last, shown] / share[shown]).mean(axis=1)
        top = _top(course, peak - first, reach)
        peak = first + top
        if peak in kept:
            continue
        start, closed, opened, end, halfway, width = _times(times[first:last], course, top)
        if width > _WIDEST or times[peak] - halfway > _SLOW:
            continue
        wink = known.all() and not both and width > _FAST
        eyes = tuple(shown.tolist()) if wink else (0, 1)
        height = float((pulses[peak, shown]).max())
        guessed = len(shown) < 2 and not wink
        blinks.append(EyeClosing("blink", eyes, start, closed, opened, end, height, guessed))
        kept.append(peak)
    return blinks, np.array(kept, dtype=np.int64)


def _shares(relative: FloatArray, skin: BoolArray, peak: int, reach: int) -> FloatArray:
    """Return how high the lids' own pulses are around a peak: (2,)."""
    around = slice(max(peak - reach, 0), peak + reach + 1)
    tops = relative[around].argmax(axis=0), (0, 1)
    return np.where(skin[around][tops], 0.0, relative[around][tops])


def _threshold(heights: FloatArray) -> float:
    """Return the height between blinks and other pulses: within the widest step in doubt."""
    doubted = heights[(heights > _DOUBTED) & (heights < _SURE)]
    steps = np.sort(np.concatenate([[_DOUBTED, _SURE], doubted]))
    widest = int(np.argmax(np.diff(np.log(steps))))
    return float(np.sqrt(steps[widest] * steps[widest + 1]))


def _top(course: FloatArray, peak: int, reach: int) -> int:
    first = max(peak - reach, 0)
    return first + int(np.argmax(course[first : peak + reach + 1]))


def _times(
    times: FloatArray, course: FloatArray, peak: int
) -> tuple[float, float, float, float, float, float]:
    """Return start, closed, opened and end of a pulse: [s].

    Then the time at which it is half closed, and its width there.
    """
    share = course / course[peak]
    before = {level: _crossing(times, share, peak, -1, level) for level in (0.1, 0.5, 0.9)}
    after = {level: _crossing(times, share, peak, 1, level) for level in (0.1, 0.5, 0.9)}
    closing = np.clip((before[0.9] - before[0.1]) / (_NINETY - _TEN), *_CLOSING)
    opening = np.clip((after[0.1] - after[0.9]) / (_NINETY - _TEN), *_OPENING)
    # Closed by the peak, in a frame of the take.
    closed = min(before[0.5] + 0.5 * closing, times[peak])
    opened = max(after[0.5] - 0.5 * opening, times[peak])
    width = after[0.5] - before[0.5]
    return closed - closing, closed, opened, opened + opening, before[0.5], float(width)


def _crossing(times: FloatArray, share: FloatArray, peak: int, way: int, level: float) -> float:
    """Return the time at which a pulse passes a level, going away from its peak: [s]."""
    side = share[peak:] if way > 0 else share[peak::-1]
    at = times[peak:] if way > 0 else times[peak::-1]
    below = np.flatnonzero(side < level)
    if not len(below):
        return float(at[-1])
    k = int(below[0])
    high, low = side[k - 1], side[k]
    return float(at[k - 1] + (at[k] - at[k - 1]) * (high - level) / max(high - low, 1e-12))


def _by_itself(own: FloatArray | None, closing: FloatArray) -> BoolArray:
    """Return where a lid comes down by itself, not with the skin around it: (F, 2)."""
    # NaN says nothing.
    return ~(own < _OWN * closing) if own is not None else np.ones(closing.shape, dtype=bool)


def _held(
    times: FloatArray, closing: FloatArray, level: FloatArray, own: BoolArray
) -> list[EyeClosing]:
    """Return the times in which eyes stay closed: `closing` (F, 2), that of blinks `level` (2,).

    `own` (F, 2): False where only the skin around a lid moves it.
    """
    held = []
    for eye in (0, 1):
        share, other = closing[:, eye] / level[eye], closing[:, 1 - eye] / level[1 - eye]
        # An eye that is not seen contradicts nothing.
        alone = (other < _CONTRADICTED) | ~own[:, 1 - eye]
        closed = share >= np.where(alone, _CLOSED_ALONE, _CLOSED)
        # The eye that is closed alone is the one that is closed further.
        closed &= ~(alone & (closing[:, eye] < closing[:, 1 - eye]))
        held += _held_eye(times, share, closed & own[:, eye], eye)
    return held


def _held_eye(
    times: FloatArray, share: FloatArray, closed: BoolArray, eye: int
) -> list[EyeClosing]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], closed, [False]]).astype(np.int8)))
    held: list[EyeClosing] = []
    for first, stop in edges.reshape(-1, 2).tolist():
        last = stop - 1
        if times[last] - times[first] < _HELD:
            continue
        level = _STILL_CLOSED * float(np.median(share[first:stop]))
        still = first + np.flatnonzero(share[first:stop] >= level)
        first, last = int(still[0]), int(still[-1])
        start, end = _left(times, share, first, -1), _left(times, share, last, 1)
        span = (start, float(times[first]), float(times[last]), end)
        height = float(share[first:stop].max())
        # Between two that never opened the eye stays closed.
        between = share[nearest_frame(times, held[-1].opened) : first] if held else share[:0]
        if held and between.min(initial=np.inf) > _OPEN:
            previous = held.pop()
            span = (previous.start, previous.closed, *span[2:])
            height = max(height, previous.height)
        held.append(EyeClosing("held", (eye,), *span, height))
    return held


def nearest_frame(times: FloatArray, time: float) -> int:
    """Return the frame nearest to a time [s], the earlier of two."""
    after = min(int(np.searchsorted(times, time)), len(times) - 1)
    before = max(after - 1, 0)
    return before if abs(time - times[before]) <= abs(times[after] - time) else after


def _within(held: EyeClosing, blinks: Sequence[EyeClosing]) -> bool:
    """Whether a closed eye is the top of a blink."""
    return any(each.start <= held.closed and held.opened <= each.end for each in blinks)


def _left(times: FloatArray, share: FloatArray, frame: int, way: int) -> float:
    """Return the time at which the way to, or from, a closed eye begins, or ends: [s]."""
    # Beyond the slowest it is as slow.
    first, stop = np.searchsorted(times, [times[frame] - 2 * _SLOWEST, times[frame] + 2 * _SLOWEST])
    near, frame_there = slice(int(first), int(stop)), frame - int(first)
    level = _OPEN / float(share[frame])
    time = _crossing(times[near], share[near] / share[frame], frame_there, way, level)
    away = np.clip(abs(time - times[frame]), _CLOSING[0], _SLOWEST)
    return float(times[frame] + way * away)
