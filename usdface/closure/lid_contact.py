"""Weights at which the lids of an eye meet, and at which they do not cross."""

from collections.abc import Callable

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter1d

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.closure.even_times import EvenTimes
from usdface.closure.lid_gaps import LidGaps
from usdface.numerics.frame_blocks import by_blocks

__all__ = [
    "close_lids",
    "crossing",
    "looks_open",
    "lower_until_parted",
    "lowering",
    "part_crossed_lids",
]

# Shut lids that are parted at their widest place by more than this share of the opening look open,
# and by more than this many times what the closing shape alone leaves: 0.115 and 0.218 openings on
# ICT and MakeHuman, which both look shut.
_OPEN, _ALONE = 0.15, 1.15
# In openings of the eye: by how much lids may press into each other, 0.15 mm on ICT. Skin gives
# way, and rims that are not quite parallel close further.
_PRESSED = 0.02
# Bisections: 1e-5 of a weight moves a lid by 0.1 micrometres.
_HALVINGS = 17
# [m]: far below the visible.
_EXACT = 1e-6
# A share of the lower lid's way that nobody sees: tails of a fade do not move lids.
_UNSEEN = 0.01


def close_lids(weights: FloatArray, course: FloatArray, gaps: LidGaps) -> FloatArray:
    """Close an eye by its course: 0 leaves it as it is, at 1 the lids meet.

    Weights that close are raised, those that hold the upper lid up are lowered; so a second run
    changes nothing. The lower lid comes up where the shape that closes the eye leaves it open.

    Parameters
    ----------
    weights : (F, T) float64
    course : (F,) float64
    gaps : LidGaps

    Returns
    -------
    (F, T) float64
    """
    frames = np.flatnonzero(course > 0)
    if not len(frames):
        return weights
    own, share = weights[frames].copy(), course[frames]
    closed = own.copy()
    raisers, tighteners = list(gaps.raisers), list(gaps.tighteners)
    closed[:, raisers] = 0.0

    def least(columns: list[int]) -> FloatArray:
        return by_blocks(len(closed), lambda block: _least_weight(closed[block], columns, gaps))

    closed[:, gaps.closer] = least([gaps.closer])
    tight = least(tighteners) if tighteners else np.zeros(len(frames))
    own[:, raisers] = np.minimum(own[:, raisers], 1.0 - share[:, None])
    own[:, gaps.closer] = np.maximum(own[:, gaps.closer], share * closed[:, gaps.closer])
    own[:, tighteners] = np.maximum(own[:, tighteners], (share * tight)[:, None])
    result = weights.copy()
    result[frames] = own
    return result


def lowering(weights: FloatArray, gaps: LidGaps, free: BoolArray) -> FloatArray:
    """Return the shares (F,) by which the lower lid gives way where lids cross.

    Shut lids that are parted stay open in part if the lower lid is raised unevenly. Where they look
    open (`looks_open`), shapes that raise the lower lid give way, as far as it takes.

    Parameters
    ----------
    weights : (F, T) float64
    gaps : LidGaps
    free : (T,) bool
        Blend shapes that may change.
    """
    return _lowering(weights, lower_until_parted(weights, gaps, free), gaps, free)


def part_crossed_lids(
    weights: FloatArray,
    gaps: LidGaps,
    free: BoolArray,
    share: FloatArray | None = None,
    fade: int = 0,
    even: EvenTimes | None = None,
) -> FloatArray:
    """Part lids that cross: the closing shape's weight is lowered first, then all movers'.

    Shapes that raise the lower lid give way by a share, and the upper lid comes down in their
    place.

    Parameters
    ----------
    weights : (F, T) float64
    gaps : LidGaps
    free : (T,) bool
        Blend shapes that may change.
    share : (F,) float64, optional
        By which the lower lid gives way; that of `lowering`, if left out.
    fade : int
        Number of frames over which the lower lid gives way before lids cross, and comes back after;
        0 = at once.
    even : EvenTimes, optional
        Of which `fade` counts the frames; of the take's own, if left out.

    Returns
    -------
    (F, T) float64
        Equal to `weights` in frames in which the lids do not cross, nor near ones in which the
        lower lid gives way.
    """
    parted = lower_until_parted(weights, gaps, free)
    share = _faded(_lowering(weights, parted, gaps, free) if share is None else share, fade, even)
    frames = np.flatnonzero(share)
    if len(frames):
        parted[frames] = _lowered(weights[frames], share[frames], gaps, free)
    return parted


def _lowering(
    weights: FloatArray, parted: FloatArray, gaps: LidGaps, free: BoolArray
) -> FloatArray:
    """Return the least shares (F,) to lower what raises the lower lid by, for lids to look shut."""
    share = np.zeros(len(weights))
    limit = looks_open(gaps)
    frames = np.flatnonzero((parted != weights).any(axis=1))
    before = gaps.widest(weights[frames])
    frames, before = frames[before < limit], before[before < limit]
    if not len(frames):
        return share

    def left(share: FloatArray) -> FloatArray:
        return gaps.widest(_lowered(weights[frames], share, gaps, free))

    wide = gaps.widest(parted[frames])
    # Shut lids are to look shut; the further they were parted before, the less it counts.
    shut = 1.0 - (before / limit).clip(min=0.0)
    allowed = wide + shut * (limit - wide).clip(max=0.0)
    allowed = np.maximum(allowed, left(np.ones(len(frames))) + _EXACT)
    share[frames] = _bisected(lambda share: left(share) <= allowed, len(frames))
    return share


def _lowered(weights: FloatArray, share: FloatArray, gaps: LidGaps, free: BoolArray) -> FloatArray:
    """Return weights at which the lower lid gave way, and the upper lid came down in its place.

    The upper lid comes down until the lids are as near as before, or meet. So how far it was down
    in a frame does not count where the lids cross: its noise would go into the lower lid.
    """
    squeezers = [k for k in {*gaps.tighteners, *gaps.cheek_raisers} if free[k]]
    own = weights.copy()
    own[:, squeezers] *= 1.0 - share[:, None]
    if free[gaps.closer] and squeezers:
        own[:, gaps.closer] = np.maximum(own[:, gaps.closer], 1.0)
        nearest = np.maximum(gaps.least(weights), -_PRESSED * gaps.opening)
        own = _scaled(own, np.array([gaps.closer]), gaps, nearest)
    return lower_until_parted(own, gaps, free)


def _faded(share: FloatArray, frames: int, even: EvenTimes | None) -> FloatArray:
    """Return shares (F,) that rise and fall over some frames, and are no less anywhere."""
    # The weighted mean, over a window around each frame, of the largest within as long a window.
    length = 2 * (frames // 2) + 1
    if length == 1 or not share.any():
        return share
    shares = share if even is None else even.resampled(share)
    most = maximum_filter1d(shares, length, mode="nearest")
    window = np.hanning(length + 2)[1:-1]
    faded = np.asarray(convolve1d(most, window / window.sum(), mode="nearest"))
    faded = faded if even is None else even.of_frames(faded)
    return np.asarray(np.maximum(share, (faded - _UNSEEN) / (1.0 - _UNSEEN)))


def lower_until_parted(weights: FloatArray, gaps: LidGaps, free: BoolArray) -> FloatArray:
    """Lower the closing shape's weight, then all movers', until the lids do not cross."""
    result = weights.copy()
    movers = np.flatnonzero(gaps.movers & free)
    for columns in (np.intersect1d(movers, [gaps.closer]), movers):
        frames = np.flatnonzero(crossing(result, gaps) > _EXACT)
        if len(frames) and len(columns):
            nearest = np.full(len(frames), -_PRESSED * gaps.opening)
            result[frames] = _scaled(result[frames], columns, gaps, nearest)
    return result


def looks_open(gaps: LidGaps) -> float:
    """Return the gap at the widest place from which shut lids look open [m]."""
    alone = np.zeros((1, len(gaps.movers)))
    alone[:, gaps.closer] = _least_weight(alone, [gaps.closer], gaps)
    return max(_OPEN * gaps.opening, _ALONE * float(gaps.widest(alone)[0]))


def crossing(weights: FloatArray, gaps: LidGaps) -> FloatArray:
    """Return by how much the lids cross beyond the allowed depth (`_PRESSED`): (F,) [m]."""
    return by_blocks(len(weights), lambda frames: _crossed(gaps.at(weights[frames]), gaps))


def _crossed(distances: FloatArray, gaps: LidGaps) -> FloatArray:
    return np.asarray(np.maximum(-_PRESSED * gaps.opening - distances.min(axis=1), 0.0))


def _least_weight(weights: FloatArray, columns: list[int], gaps: LidGaps) -> FloatArray:
    """Return the least weight (F,) of some columns at which the lids meet; 1 if they never do."""
    ends = weights.copy(), weights.copy()
    for end, value in zip(ends, (0.0, 1.0), strict=True):
        end[:, columns] = value
    between = gaps.between(*ends)

    def met(weight: FloatArray) -> BoolArray:
        least, widest = gaps.ends_of(between(weight))
        return np.asarray((least <= -_PRESSED * gaps.opening) | (widest <= 0.0))

    return _bisected(met, len(weights))


def _scaled(
    weights: FloatArray, columns: IntArray, gaps: LidGaps, nearest: FloatArray
) -> FloatArray:
    """Return weights with some columns scaled down until no gap is below `nearest` (F,) [m]."""
    lowest = weights.copy()
    lowest[:, columns] = 0.0
    between = gaps.between(weights, lowest)
    share = _bisected(lambda share: between(share).min(axis=1) >= nearest, len(weights))
    return np.asarray(weights + share[:, None] * (lowest - weights))


def _bisected(reached: Callable[[FloatArray], BoolArray], count: int) -> FloatArray:
    """Return the least value in [0, 1] at which a condition is met: (count,); 1 if never."""
    low, high = np.zeros(count), np.ones(count)
    at_once = reached(low)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        met = reached(middle)
        low, high = np.where(met, low, middle), np.where(met, middle, high)
    return np.where(at_once, 0.0, high)
