"""Blinks and closed eyes of a take.

How far an eye is closed comes from lids that markers see only in part, in units of the
character's closed eye (`lid_signal`). Blinks (`blinks`) tell the level at which an eye is closed;
where the lids stay there, it is held closed (`held_eyes`).
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.closure.blinks import blink_height, find_blinks
from usdface.closure.eye_closing import EyeClosing
from usdface.closure.held_eyes import find_held_eyes
from usdface.closure.lid_pulses import APART, lid_pulses

__all__ = ["find_closings"]

# Least height of the blinks of the eye that shows them better, in closed eyes of the character: in
# a take with less no blink is seen. Those of two real takes: 0.44 to 1.15.
_BETTER_SEEN = 0.3
# Of the way of a lid marker: if less of it is the lid's own, without the skin around it, a lowered
# brow brought it down (AnimFace: blinks 1, a frown 0.15 to 0.3).
_OWN = 0.5
# Shares of the opening that are gone in a closed eye at least: of the whole, as lids of a performer
# who moves them less than the rig, and of that of the take's blinks. Of 416 recorded closed eyes on
# other persons 0.46 and more, and 0.58 of the blinks; of two real takes 0.35, and 0.56; of lids
# that came back from wide open 0.29 at most.
_GONE, _GONE_OF_BLINKS = 0.25, 0.5
# A pulse that takes away as much of the opening as the take's other blinks (upper quartile), at
# least `_GONE`, is one of them, though less is gone where markers are bound to wrong places. Blinks
# of two real takes on three heads, with vertices that were proposed, 0.74 to 1.26, and 0.13 gone
# and more; half a blink of the recording 0.45 to 0.67 (0.89 in one of ten worlds). In takes whose
# pulses do not tell the level (`_SWEPT`) none is: quick squints are as large as each other.
_AS_FAR, _AWAY = 0.7, 0.1
# An eye is held closed only in a take whose blinks take away so much of the opening: geometric mean
# of the share of all of it, and of the share of the most that is ever gone, as lids may move less
# than the rig's. Of takes with blinks 0.33 to 0.61, of two real takes 0.48 and more; with fast
# squints and glances in their place 0.17 to 0.31 (more in noise).
_SWEPT = 0.25


def find_closings(
    times: FloatArray,
    closing: FloatArray,
    *,
    own: FloatArray | None = None,
    least: FloatArray | None = None,
    lids: FloatArray | None = None,
    glanced: FloatArray | None = None,
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
    lids : (F, 2) float64, optional
        Estimate of how much of the opening between the lids is gone (`lid_estimate`); NaN in all
        frames of an eye that is not seen. A lid that comes down only to where it rests closes no
        eye, and the take's blinks all end at closed lids.
    glanced : (F, 2) float64, optional
        The same if eyes may look down: an eye that stays down need not be closed. As `lids`, if
        left out.

    Returns
    -------
    list of EyeClosing
        In order of time.
    """
    if len(times) < 3:
        return []
    step = float(np.median(np.diff(times)))
    least = np.zeros(2) if least is None else least
    smooth, pulses, skin = _pulses(closing, own, step)
    scale = np.array([blink_height(pulses[:, eye], least[eye], step) for eye in (0, 1)])
    if not np.nanmax(scale, initial=0.0) >= _BETTER_SEEN:
        scale[:] = np.nan
    blinks, peaks = find_blinks(times, pulses, skin, scale, least)
    gone, swept = _opening_gone(lids, closing.shape, step)
    now = gone if glanced is None else _opening_gone(glanced, closing.shape, step)[0]
    around = 2 * round(APART / step) + 1
    gone = maximum_filter1d(gone, around, axis=0)
    most = _most_gone(gone[peaks])
    shut = most >= _least_gone(gone, peaks)
    if blinks and _tell_the_level(gone, swept[peaks]):
        shut |= _as_far(swept[peaks], blinks) & (most >= _AWAY)
    blinks = [blink for blink, is_shut in zip(blinks, shut, strict=True) if is_shut]
    peaks = peaks[shut]
    if not blinks:
        return []
    if not _tell_the_level(gone, swept[peaks]):
        return blinks
    # Only blinks say at which level an eye is closed: from rest it is their height or more.
    level = np.where(
        np.isfinite(scale), np.maximum(np.median(smooth[peaks], axis=0), scale), np.nan
    )
    # Closed by the markers and by the lids' estimate: the lesser of both.
    lid_level = np.median(maximum_filter1d(now, around, axis=0)[peaks], axis=0)
    known = np.isfinite(lid_level) & (lid_level > 0)
    smooth[:, known] = np.minimum(smooth, now * (level / np.where(known, lid_level, 1.0)))[:, known]
    held = find_held_eyes(times, smooth, level, _by_itself(own, smooth))
    closings = [*blinks, *(each for each in held if not _within(each, blinks))]
    return sorted(closings, key=lambda each: each.closed)


def _pulses(
    closing: FloatArray, own: FloatArray | None, step: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the smoothed curves of the eyes, their pulses, and where these are the skin's: (F, 2).

    0 of an eye that is not seen, and where a pulse is lower than noise.
    """
    smooth, pulses = closing.copy(), np.zeros(closing.shape)
    skin, floors = np.zeros(closing.shape, dtype=bool), np.zeros(2)
    seen = np.flatnonzero(np.isfinite(closing).all(axis=0)).tolist()
    for eye in seen:
        smooth[:, eye], pulses[:, eye], floors[eye] = lid_pulses(closing[:, eye], step)
    # Two eyes that close together stand out of the noise where one of them alone does not.
    together = (pulses.mean(axis=1) >= floors.mean() / np.sqrt(2.0)) & (len(seen) == 2)
    for eye in seen:
        pulses[(pulses[:, eye] < floors[eye]) & ~together, eye] = 0.0
        if own is not None and np.isfinite(own[:, eye]).all():
            _, lid, noise = lid_pulses(own[:, eye], step)
            lid = maximum_filter1d(lid, 2 * round(APART / step) + 1)
            skin[:, eye] = lid + noise < _OWN * pulses[:, eye]
    return smooth, pulses, skin


def _opening_gone(
    lids: FloatArray | None, shape: tuple[int, ...], step: float
) -> tuple[FloatArray, FloatArray]:
    """Return how much of the opening of each eye is gone: (F, 2).

    And how much of it a pulse around a frame takes away at most: (F, 2). Both infinite where that
    is not known.
    """
    gone, swept = np.full(shape, np.inf), np.full(shape, np.inf)
    if lids is None:
        return gone, swept
    for eye in np.flatnonzero(np.isfinite(lids).all(axis=0)):
        gone[:, eye], pulses, _ = lid_pulses(lids[:, eye], step)
        swept[:, eye] = maximum_filter1d(pulses, 2 * round(APART / step) + 1)
    return gone, swept


def _tell_the_level(gone: FloatArray, swept: FloatArray) -> bool:
    """Whether pulses that take away `swept` (N, 2) of the opening tell when an eye is closed.

    Blinks go through most of what the lids do at all; quick squints and glances do not.
    """
    known = np.isfinite(swept).all(axis=0)
    if not known.any():
        return True
    height = float(np.quantile(swept[:, known].max(axis=1), 0.75))
    low, high = np.quantile(gone[:, known].max(axis=1), [0.1, 0.99])
    return height**2 >= _SWEPT**2 * float(high - low)


def _least_gone(gone: FloatArray, peaks: IntArray) -> float:
    """Return how much of the opening is gone where an eye is closed, at least."""
    tops = _most_gone(gone[peaks])
    known = tops[np.isfinite(tops)]
    level = float(np.quantile(known, 0.75)) if len(known) else 0.0
    return max(_GONE, _GONE_OF_BLINKS * level)


def _as_far(swept: FloatArray, blinks: Sequence[EyeClosing]) -> BoolArray:
    """Whether pulses that take away `swept` (N, 2) of the opening go as far as the others: (N,)."""
    known = np.isfinite(swept).all(axis=0)
    if not known.any():
        return np.zeros(len(swept), dtype=bool)
    swept = swept[:, known]
    share = swept / np.maximum(np.quantile(swept, 0.75, axis=0), 1e-9)
    alone = np.array([blink.guessed or len(blink.eyes) < 2 for blink in blinks])
    reached = np.where(alone, share.max(axis=1), share.mean(axis=1)) >= _AS_FAR
    return np.asarray(reached & (swept.max(axis=1) >= _GONE))


def _most_gone(gone: FloatArray) -> FloatArray:
    """Return how much is gone of the opening of the eye that is closed further: (N,).

    An eye of which that is not known says nothing; infinite where it is known of neither.
    """
    known = np.isfinite(gone)
    most = np.where(known, gone, -np.inf).max(axis=1)
    return np.asarray(np.where(known.any(axis=1), most, np.inf))


def _by_itself(own: FloatArray | None, closing: FloatArray) -> BoolArray:
    """Return where a lid comes down by itself, not with the skin around it: (F, 2)."""
    # NaN says nothing.
    return ~(own < _OWN * closing) if own is not None else np.ones(closing.shape, dtype=bool)


def _within(held: EyeClosing, blinks: Sequence[EyeClosing]) -> bool:
    """Whether a closed eye is the top of a blink."""
    return any(each.start <= held.closed and held.opened <= each.end for each in blinks)
