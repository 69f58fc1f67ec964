"""Blinks and closed eyes of a take.

How far an eye is closed is measured by markers that follow the lids only in part, in units of the
character's closed eye (`lid_signal`). The peaks of blinks (`blinks`) give the level of a closed
eye; where the lids stay at it, the eye is held closed (`held_eyes`).
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.closure.blinks import blink_height, find_blinks
from usdface.closure.even_times import even_times
from usdface.closure.eye_closing import EyeClosing, in_frames
from usdface.closure.held_eyes import find_held_eyes
from usdface.closure.lid_depth import (
    LidDepth,
    as_deep_as_others,
    closed_as_solved,
    has_closed_level,
    lid_depth,
    pulses_that_close,
)
from usdface.closure.lid_pulses import APART, lid_pulses
from usdface.closure.solved_lids import SolvedLids
from usdface.takes import frame_step

__all__ = ["find_closings"]

# Least height of blinks, of the eye in which it is larger, in closed eyes of the character; a take
# below it has no blinks. Those of two real takes: 0.44 to 1.15.
_BETTER_SEEN = 0.3
# Share of a lid marker's motion that remains without that of the skin around it; below it a lowered
# brow brought the marker down (AnimFace: blinks 1, a frown 0.15 to 0.3).
_OWN = 0.5
# Share of the height of an eye's blinks below which it takes no part in one. Set by hand.
_TAKES_PART = 0.5
# Least share of the opening that blinks take away in a curve; one with less is not used.
_MEASURED = 0.1
# An eye is not closed, but its brow lowered, where the estimate would close it so many times as far
# as the take's blinks. Of recorded eyes that are pressed shut 2.1 at most, of AnimFace's frown on
# the example 2.75.
_BEYOND = 2.3
# Of an eye whose lids are not solved, where the estimate decides alone: by how much the level of a
# closed eye rises with each standard deviation of the estimate, which is 0.5 to 0.6 with 41 markers
# and 0.17 with 68. MakeHuman and the example with 41, 32 closed eyes each: with 0 all are found and
# 3.3 and 7.1 % of the take shut wrongly; with this 30 and 32, and 0.4 and 3.4 %.
_UNSURE = 0.2
# A blink is closed for so long before and after its peak at least [s]: a frame of 30 Hz. Set by
# hand: of the 0.15 s that pulses of 33 recorded blinks have at half their height.
_TOP = 1.0 / 30.0


def find_closings(
    times: FloatArray,
    closing: FloatArray,
    *,
    by_itself: FloatArray | None = None,
    least: FloatArray | None = None,
    gone: FloatArray | None = None,
    deviation: FloatArray | None = None,
    solved: SolvedLids | None = None,
) -> tuple[list[EyeClosing], IntArray]:
    """Find blinks and closed eyes, and the pulses like blinks that leave the eyes open.

    Parameters
    ----------
    times : (F,) float64 [s]
    closing : (F, 2) float64
        How far the left and the right eye are closed: 0 as in the neutral frames, 1 as the
        character's closed eye; NaN in all frames of an eye that is not measured.
    by_itself : (F, 2) float64, optional
        The same of the lids by themselves, without the skin around them (`lid_motion`); NaN where
        that is not known. A lid that its brow lowers does not close the eye.
    least : (2,) float64, optional
        Least height of a blink's pulse; smaller ones are motion of the skin.
    gone : (F, 2) float64, optional
        Estimate of how much of the opening between the lids is gone (`lid_estimate`); NaN in all
        frames of an eye that is not measured. Pulses that do not end at closed lids are dropped
        (`pulses_that_close`).
    deviation : (2,) float64, optional
        Standard deviation of that estimate, for eyes whose lids are not solved: they have to be
        closed by so much more.
    solved : SolvedLids, optional
        Pulses that are solved less deep than the take's other blinks are dropped
        (`as_deep_as_others`); those solved as squints or glances give no level of a closed eye
        (`has_closed_level`), and without it they are dropped, too (`closed_as_solved`).

    Returns
    -------
    closings : list of EyeClosing
        In order of time.
    left_open : (N,) int64
        Frame index of the peak of each pulse that was dropped as one that does not close the eye.
    """
    if len(times) < 3:
        return [], np.zeros(0, dtype=np.int64)
    even = even_times(times)
    by_itself, gone = (
        None if curve is None else even.resampled(curve) for curve in (by_itself, gone)
    )
    if solved is not None:
        solved = SolvedLids(even.resampled(solved.closed), even.resampled(solved.by_closer))
    found, peaks = _find_evenly(
        even.times,
        even.resampled(closing),
        by_itself=by_itself,
        least=np.zeros(2) if least is None else least,
        gone=gone,
        deviation=np.zeros(2) if deviation is None else deviation,
        solved=solved,
    )
    return [in_frames(each, even) for each in found], even.frames(peaks)


def _find_evenly(
    times: FloatArray,
    closing: FloatArray,
    *,
    by_itself: FloatArray | None,
    least: FloatArray,
    gone: FloatArray | None,
    deviation: FloatArray,
    solved: SolvedLids | None,
) -> tuple[list[EyeClosing], IntArray]:
    """Return closings, and pulses that leave the eyes open, at even times: see `find_closings`."""
    step = frame_step(times)
    smooth, pulses, skin = _pulses(closing, by_itself, step)
    scale = np.array([blink_height(pulses[:, eye], least[eye], step) for eye in (0, 1)])
    if not np.nanmax(scale, initial=0.0) >= _BETTER_SEEN:
        scale[:] = np.nan
    blinks, peaks = find_blinks(times, pulses, skin, scale, least)
    unknown = np.full(closing.shape, np.nan)
    unsolved = np.isnan(solved.closed).all(axis=0) if solved is not None else np.zeros(2, bool)
    solved = SolvedLids(unknown, unknown) if solved is None else solved
    gone = unknown if gone is None else gone
    depth = lid_depth(gone, step)
    as_solved, by_closer = lid_depth(solved.closed, step), lid_depth(solved.by_closer, step)
    closed = pulses_that_close(depth, peaks, blinks, _reached(pulses, scale, peaks, step))
    closed[closed] = as_deep_as_others(as_solved, peaks[closed])
    known = closed.any() and has_closed_level(depth, as_solved, by_closer, peaks[closed])
    if closed.any() and not known:
        among = [blink for blink, is_closed in zip(blinks, closed, strict=True) if is_closed]
        closed[closed] = closed_as_solved(as_solved, by_closer, peaks[closed], among)
    blinks = [blink for blink, is_closed in zip(blinks, closed, strict=True) if is_closed]
    left_open, peaks = peaks[~closed], peaks[closed]
    if not known:
        return blinks, left_open
    # The level of a closed eye is that of its own blinks: their height above rest, at least.
    own_peaks = _eyes_that_blink(pulses, scale, blinks, peaks, step)
    level = np.maximum(_level(_at_top(closing, peaks, step), own_peaks), scale)
    lid_level, solved_level = (
        _level(_at_top(curve, peaks, step), own_peaks) for curve in (gone, solved.closed)
    )
    surely = np.where(unsolved & np.isfinite(deviation), 1.0 + _UNSURE * deviation, 1.0)
    level, lid_level = surely * level, surely * lid_level
    # Closed by the markers, by the lids' estimate and as solved: the least of the three.
    smooth = _no_further_than(depth, smooth, level, lid_level)
    smooth = _no_further_than(as_solved, smooth, level, solved_level)
    held = find_held_eyes(times, smooth, level, _closes_by_itself(by_itself, smooth))
    held = _not_beyond_closed(held, times, depth.gone, lid_level)
    closings = [*blinks, *(each for each in held if not _within(each, blinks))]
    return sorted(closings, key=lambda each: each.closed), left_open


def _pulses(
    closing: FloatArray, by_itself: FloatArray | None, step: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the smoothed curves of the eyes, their pulses, and where these are the skin's: (F, 2).

    The pulses are 0 for an eye that is not measured, and where they are lower than noise.
    """
    smooth, pulses = closing.copy(), np.zeros(closing.shape)
    skin, floors = np.zeros(closing.shape, dtype=bool), np.zeros(2)
    measured = np.flatnonzero(np.isfinite(closing).all(axis=0)).tolist()
    for eye in measured:
        smooth[:, eye], pulses[:, eye], floors[eye] = lid_pulses(closing[:, eye], step)
    # The mean of two eyes has less noise than each of them.
    together = (pulses.mean(axis=1) >= floors.mean() / np.sqrt(2.0)) & (len(measured) == 2)
    for eye in measured:
        pulses[(pulses[:, eye] < floors[eye]) & ~together, eye] = 0.0
        if by_itself is not None and np.isfinite(by_itself[:, eye]).all():
            _, lid, noise = lid_pulses(by_itself[:, eye], step)
            lid = maximum_filter1d(lid, 2 * round(APART / step) + 1)
            skin[:, eye] = lid + noise < _OWN * pulses[:, eye]
    return smooth, pulses, skin


def _reached(pulses: FloatArray, scale: FloatArray, peaks: IntArray, step: float) -> FloatArray:
    """Return the height of each pulse by that of the take's blinks: (N,), mean of the eyes."""
    around = maximum_filter1d(pulses, 2 * round(APART / step) + 1, axis=0)[peaks]
    known = np.isfinite(scale)
    return np.asarray((around[:, known] / scale[known]).sum(axis=1) / max(int(known.sum()), 1))


def _eyes_that_blink(
    pulses: FloatArray,
    scale: FloatArray,
    blinks: Sequence[EyeClosing],
    peaks: IntArray,
    step: float,
) -> BoolArray:
    """Return which eyes have each blink's pulse: (N, 2); not the open one of a wink."""
    around = maximum_filter1d(pulses, 2 * round(APART / step) + 1, axis=0)[peaks]
    closed = np.array([[eye in blink.eyes for eye in (0, 1)] for blink in blinks])
    return np.asarray(closed & (around >= _TAKES_PART * scale))


def _at_top(curve: FloatArray, peaks: IntArray, step: float) -> FloatArray:
    """Return a curve (F, 2) at the tops of blinks: (N, 2), without the smoothing of pulses.

    That flattens a blink, but no eye that is held closed.
    """
    width = 2 * round(_TOP / step) + 1
    return np.asarray(uniform_filter1d(curve, width, axis=0, mode="nearest")[peaks])


def _level(curves: FloatArray, used: BoolArray) -> FloatArray:
    """Return the median of (N, 2) for each eye, over the rows that are used; NaN without one."""
    own = [curves[used[:, eye], eye] for eye in (0, 1)]
    return np.array([np.median(each) if len(each) else np.nan for each in own])


def _no_further_than(
    depth: LidDepth, smooth: FloatArray, level: FloatArray, other_level: FloatArray
) -> FloatArray:
    """Return how far the eyes are closed (F, 2): the smaller of `smooth` and another measure.

    At the peaks of the blinks the two are `level` and `other_level` (2,).
    """
    known = np.isfinite(other_level) & (other_level > _MEASURED)
    share = level / np.where(known, other_level, 1.0)
    return np.asarray(np.where(known, np.minimum(smooth, depth.gone * share), smooth))


def _not_beyond_closed(
    held: Sequence[EyeClosing], times: FloatArray, gone: FloatArray, level: FloatArray
) -> list[EyeClosing]:
    """Return the closed eyes less those whose lids would be closed far further than in blinks.

    And those of the other eye meanwhile: brows are lowered together. `gone` (F, 2) is how far the
    lids are closed, `level` (2,) the same at the peaks of the take's blinks.
    """

    def is_beyond(each: EyeClosing) -> bool:
        (eye,) = each.eyes
        first, stop = np.searchsorted(times, [each.closed, each.opened])
        return bool(np.median(gone[first : stop + 1, eye]) > _BEYOND * level[eye])

    beyond = [each for each in held if is_beyond(each)]
    return [
        each
        for each in held
        if not any(each.closed <= other.opened and other.closed <= each.opened for other in beyond)
    ]


def _closes_by_itself(by_itself: FloatArray | None, closing: FloatArray) -> BoolArray:
    """Return where a lid comes down by itself, not with the skin around it: (F, 2)."""
    # An unknown motion (NaN) compares as False, and counts as the lid's.
    return (
        ~(by_itself < _OWN * closing)
        if by_itself is not None
        else np.ones(closing.shape, dtype=bool)
    )


def _within(held: EyeClosing, blinks: Sequence[EyeClosing]) -> bool:
    """Whether a closed eye is the top of a blink of that eye."""
    return any(
        each.start <= held.closed and held.opened <= each.end and {*held.eyes} <= {*each.eyes}
        for each in blinks
    )
