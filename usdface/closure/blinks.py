"""Blinks, recognised by the course of the lids over time.

A blink is a pulse: the lid comes down fast, hardly rests and goes up again. A morphological opening
takes away every pulse that is shorter than a blink can last; the difference (white top-hat) leaves
only pulses, whatever the level of the lids between them: squints, glances down and raised brows
stay out. The height of blinks is measured in the take itself.

Sources of the times: an endogenous blink takes about 100 ms to full closure, hides the view for at
most 300 ms and takes about 100 ms to reopen, together 500 ms (J. Stern, L. Walrath, R. Goldstein,
"The endogenous eyeblink", Psychophysiology 21, 1984). Closing is 40 to 47 % faster than opening
(C. Sforza et al., "Spontaneous blinking in healthy persons", Ophthalmic and Physiological Optics
28, 2008, by optical markers).
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.blink_motion import LONGEST_BLINK
from usdface.closure.eye_closing import EyeClosing
from usdface.closure.lid_pulses import APART, LEAST_HEIGHT, crossing_time
from usdface.numerics.local_maxima import local_maxima
from usdface.takes import frame_step

__all__ = ["blink_height", "find_blinks"]

# Heights of pulses relative to the take's blinks: never a blink below the first, always above the
# second; between them the widest gap in the sorted heights decides. A pulse of one eye alone counts
# only above the third.
_DOUBTED, _SURE, _ALONE = 0.35, 0.6, 0.6
# The other eye takes part from this share on.
_SHARED = 0.25
# Spontaneous blinks are of both eyes; a pulse of one eye that is narrower at half its height [s] is
# no wink, but a blink of which the markers missed the other lid.
_FAST = 0.2
# A pulse is a squint or a glance if the second half of its closing takes longer [s], or if it is
# wider at half its height. Of 33 recorded blinks, filtered by their recording, 0.04 to 0.114 and
# 0.09 to 0.30; of other pulses 0.09 to 0.29 and more.
_SLOW, _WIDEST = 0.115, 0.35
# Filters of a recording slow all its blinks: a pulse up to so much slower than the median of the
# take's blinks is one, too. Those of two real takes on three heads take 0.86 to 1.12 of it.
_AS_SLOW = 1.15
# Limits of closing and opening [s] between open and closed: fastest 50 to slowest 150 of a blink
# that closes, twice that where it opens; an eye that is held closed may take its time.
_CLOSING, _OPENING = (0.05, 0.15), (0.08, 0.3)
# A raised cosine is at 10 and 90 % after these shares of its length.
_TEN, _NINETY = np.arccos(0.8) / np.pi, 1.0 - np.arccos(0.8) / np.pi


def blink_height(pulses: FloatArray, least: float, step: float) -> float:
    """Return the height of an eye's blinks; NaN if none is found.

    Parameters
    ----------
    pulses : (F,) float64
        In closed eyes of the character.
    least : float
        Least height of a lid's pulse; smaller ones are motion of the skin.
    step : float [s]
        Between two frames.
    """
    peaks = local_maxima(pulses, max(LEAST_HEIGHT, least), max(int(APART / step), 1))
    if not len(peaks):
        return float("nan")
    heights = np.sort(pulses[peaks])[::-1]
    # The upper quartile: the highest alone may be a squeeze, or noise.
    return float(np.quantile(heights, 0.75))


def find_blinks(
    times: FloatArray,
    pulses: FloatArray,
    skin: BoolArray,
    scale: FloatArray,
    least: FloatArray,
) -> tuple[list[EyeClosing], IntArray]:
    """Return the blinks (N of them), and the frame index of each one's peak: (N,).

    Parameters
    ----------
    times : (F,) float64 [s]
    pulses : (F, 2) float64
        Of the left and the right eye, in closed eyes of the character.
    skin : (F, 2) bool
        Where a pulse is motion of the skin around the lid: no evidence of a blink of that eye.
    scale : (2,) float64
        Height of each eye's blinks (`blink_height`); NaN = none is found.
    least : (2,) float64
        Least height of a pulse of each lid.
    """
    step = frame_step(times)
    known = np.isfinite(scale)
    if not known.any():
        return [], np.zeros(0, np.int64)
    relative = np.where(known, pulses / np.where(known, scale, 1.0), 0.0)
    strongest = relative.max(axis=1)
    peaks = local_maxima(np.pad(strongest, 1), _DOUBTED, max(int(APART / step), 1)) - 1
    reach, around = round(APART / step), round(2 * LONGEST_BLINK / step)
    shares = np.array([_shares(relative, skin, peak, reach) for peak in peaks]).reshape(-1, 2)
    high = (shares * np.where(known, scale, 0.0) >= least).any(axis=1)
    peaks, shares = peaks[high], shares[high]
    threshold = _threshold(shares.max(axis=1, initial=0.0))
    blinks, kept, closing_times = [], [], []
    for peak, share in zip(peaks.tolist(), shares, strict=True):
        both = bool((share >= _SHARED).all())
        if share.max() < (threshold if both or not known.all() else _ALONE):
            continue
        # The mean course of the eyes with this pulse: they move together.
        pulsing = np.flatnonzero(share >= _SHARED)
        first, last = max(peak - around, 0), peak + around + 1
        course = (relative[first:last, pulsing] / share[pulsing]).mean(axis=1)
        top = _top(course, peak - first, reach)
        peak = first + top
        if peak in kept:
            continue
        start, closed, opened, end, second_half, width = _times(times[first:last], course, top)
        if width > _WIDEST:
            continue
        wink = known.all() and not both and width > _FAST
        eyes = tuple(pulsing.tolist()) if wink else (0, 1)
        height = float((pulses[peak, pulsing]).max())
        guessed = len(pulsing) < 2 and not wink
        blinks.append(EyeClosing("blink", eyes, start, closed, opened, end, height, guessed))
        kept.append(peak)
        closing_times.append(second_half)
    fast = _fast_enough(np.array(closing_times))
    return [blinks[k] for k in fast], np.array(kept, dtype=np.int64)[fast]


def _fast_enough(closing_times: FloatArray) -> IntArray:
    """Return which pulses close as fast as blinks do, by how long the second half takes [s]."""
    blinks = closing_times[closing_times <= _SLOW]
    limit = max(_SLOW, _AS_SLOW * float(np.median(blinks))) if len(blinks) else _SLOW
    return np.flatnonzero(closing_times <= limit)


def _shares(relative: FloatArray, skin: BoolArray, peak: int, reach: int) -> FloatArray:
    """Return the height of each lid's own pulse around a peak: (2,)."""
    around = slice(max(peak - reach, 0), peak + reach + 1)
    tops = relative[around].argmax(axis=0), (0, 1)
    return np.where(skin[around][tops], 0.0, relative[around][tops])


def _threshold(heights: FloatArray) -> float:
    """Return the height that separates blinks from other pulses: in the widest gap in doubt."""
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

    Then how long the second half of its closing takes, and its width at half its height.
    """
    share = course / course[peak]
    before = {level: crossing_time(times, share, peak, -1, level) for level in (0.1, 0.5, 0.9)}
    after = {level: crossing_time(times, share, peak, 1, level) for level in (0.1, 0.5, 0.9)}
    # Half shut where the lids are, also where a tail is so slow that the whole would begin before
    # the peak.
    closing = (before[0.9] - before[0.1]) / (_NINETY - _TEN)
    closing = np.clip(min(closing, 2.0 * (times[peak] - before[0.5])), *_CLOSING)
    opening = (after[0.1] - after[0.9]) / (_NINETY - _TEN)
    opening = np.clip(min(opening, 2.0 * (after[0.5] - times[peak])), *_OPENING)
    # Closed by the peak, in a frame of the take.
    closed = min(before[0.5] + 0.5 * closing, times[peak])
    opened = max(after[0.5] - 0.5 * opening, times[peak])
    width = after[0.5] - before[0.5]
    second_half = _time_of_top(times, share, peak) - before[0.5]
    return closed - closing, closed, opened, opened + opening, second_half, float(width)


def _time_of_top(times: FloatArray, share: FloatArray, peak: int) -> float:
    """Return the time of a peak, between frames: that of a parabola through three of them [s]."""
    if not 0 < peak < len(share) - 1:
        return float(times[peak])
    rise, fall = share[peak] - share[peak - 1], share[peak] - share[peak + 1]
    if min(rise, fall) < 0.0 or rise + fall <= 0.0:
        return float(times[peak])
    step = 0.5 * float(times[peak + 1] - times[peak - 1])
    return float(times[peak]) + 0.5 * step * float((rise - fall) / (rise + fall))
