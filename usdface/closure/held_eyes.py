"""Eyes that are held closed: lids that stay at the level of the take's blinks."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.closure.eye_closing import EyeClosing, nearest_frame
from usdface.closure.lid_pulses import crossing_time
from usdface.numerics.frame_ranges import frame_ranges
from usdface.numerics.ramps import smooth_step

__all__ = ["find_held_eyes"]

# Closed at this share of the height of the blinks; open again, or not yet closing, at the second.
_CLOSED, _OPEN = 0.8, 0.35
# Open halfway at this: a squint between two closings (a labelled one of ten seconds: 0.5). From
# here to closed the lids follow by degrees.
_HALF_OPEN = 0.7
# Closed at this where the other eye is below the second: one eye alone may be a twitch of its
# cheek.
_CLOSED_ALONE, _CONTRADICTED = 0.85, 0.72
# Share of the median level of an eye that is held closed; below it the eye is closing or opening,
# even where the blinks of the take go no further. Set by hand.
_STILL_CLOSED = 0.8
# Shortest time [s] at that level that is no blink, and the rounding of times.
_HELD, _ROUNDING = 0.1, 1e-9
# Closing and opening [s]: as fast as the fastest blink, and slower than the slowest.
_FASTEST, _SLOWEST = 0.05, 0.5


def find_held_eyes(
    times: FloatArray, closing: FloatArray, level: FloatArray, own: BoolArray
) -> list[EyeClosing]:
    """Return the times in which eyes stay closed, the left eye's first.

    Parameters
    ----------
    times : (F,) float64 [s]
    closing : (F, 2) float64
        How far each eye is closed; NaN = not measured.
    level : (2,) float64
        The same at the peaks of the take's blinks.
    own : (F, 2) bool
        Where the lid moves, and not only the skin around it.
    """
    held = []
    for eye in (0, 1):
        share, other = closing[:, eye] / level[eye], closing[:, 1 - eye] / level[1 - eye]
        # An eye that is not measured (NaN) contradicts nothing.
        alone = (other < _CONTRADICTED) | ~own[:, 1 - eye]
        # Eyes that narrow together close together: by their mean, whichever is a little ahead.
        together = np.where(np.isnan(other), share, (share + other) / 2.0)
        closed = np.where(alone, share >= _CLOSED_ALONE, together >= _CLOSED)
        closed &= alone | (share >= _CONTRADICTED)
        # The eye that is closed alone is the one that is closed further.
        closed &= ~(alone & (closing[:, eye] < closing[:, 1 - eye]))
        # Its lids follow the mean where they are behind, and further closed than half open.
        ahead = np.maximum(together - share, 0.0)
        lids = share + ahead * smooth_step((share - _HALF_OPEN) / (_CONTRADICTED - _HALF_OPEN))
        held += _held_eye(times, share, lids, closed & own[:, eye], eye)
    return held


def _held_eye(
    times: FloatArray, share: FloatArray, lids: FloatArray, closed: BoolArray, eye: int
) -> list[EyeClosing]:
    """Return the times (F,) in which an eye stays `closed`; between them its `lids` are followed.

    `share` and `lids` are shares of the level of a closed eye.
    """
    held: list[EyeClosing] = []
    lids = smooth_step((lids - _HALF_OPEN) / (_CLOSED - _HALF_OPEN))
    for first, last in frame_ranges(closed):
        stretch = share[first : last + 1]
        if times[last] - times[first] < _HELD - _ROUNDING:
            continue
        level = _STILL_CLOSED * float(np.median(stretch))
        still = first + np.flatnonzero(stretch >= level)
        first, last = int(still[0]), int(still[-1])
        start, end = _open_time(times, share, first, -1), _open_time(times, share, last, 1)
        span = (start, float(times[first]), float(times[last]), end)
        height = float(stretch.max())
        # Two between which the eye never opens halfway are one.
        between = share[nearest_frame(times, held[-1].opened) : first] if held else share[:0]
        if held and between.min(initial=np.inf) > _HALF_OPEN:
            previous = held.pop()
            span = (previous.start, previous.closed, *span[2:])
            height = max(height, previous.height)
        held.append(EyeClosing("held", (eye,), *span, height, lids=lids))
    return held


def _open_time(times: FloatArray, share: FloatArray, frame: int, way: int) -> float:
    """Return the time at which an eye is open before (way -1) or after (1) a closed frame: [s]."""
    # An eye that opens later counts as the slowest.
    first, stop = np.searchsorted(times, [times[frame] - 2 * _SLOWEST, times[frame] + 2 * _SLOWEST])
    near, frame_there = slice(int(first), int(stop)), frame - int(first)
    level = _OPEN / float(share[frame])
    time = crossing_time(times[near], share[near] / share[frame], frame_there, way, level)
    away = np.clip(abs(time - times[frame]), _FASTEST, _SLOWEST)
    return float(times[frame] + way * away)
