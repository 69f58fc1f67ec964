"""Weights at which the lids of an eye meet, and at which they do not cross."""

from collections.abc import Callable

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.closure.even_times import EvenTimes
from usdface.closure.lid_apertures import LidApertures
from usdface.numerics.frame_blocks import by_blocks
from usdface.numerics.hann_window import hann_envelope

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


def close_lids(weights: FloatArray, course: FloatArray, apertures: LidApertures) -> FloatArray:
    """Close an eye by its course: 0 leaves it as it is, at 1 the lids meet.

    Weights that close are raised, those that hold the upper lid up are lowered, from what they are
    before and after the closing; so a second run changes nothing. The lower lid comes up where the
    shape that closes the eye leaves it open.

    Parameters
    ----------
    weights : (F, T) float64
    course : (F,) float64
    apertures : LidApertures

    Returns
    -------
    (F, T) float64
    """
    frames = np.flatnonzero(course > 0)
    if not len(frames):
        return weights
    own, share = weights[frames].copy(), course[frames]
    closed = own.copy()
    raisers, tighteners = list(apertures.raisers), list(apertures.tighteners)
    closed[:, raisers] = 0.0

    def least(columns: list[int]) -> FloatArray:
        return by_blocks(
            len(closed), lambda block: _least_weight(closed[block], columns, apertures)
        )

    closed[:, apertures.closer] = least([apertures.closer])
    closed[:, tighteners] = least(tighteners)[:, None] if tighteners else 0.0
    closers, share = [apertures.closer, *tighteners], share[:, None]
    before = np.minimum(_as_around(weights[:, closers], course), closed[:, closers])
    own[:, closers] = np.maximum(own[:, closers], before + share * (closed[:, closers] - before))
    own[:, raisers] = np.minimum(
        own[:, raisers], (1.0 - share) * _as_around(weights[:, raisers], course)
    )
    result = weights.copy()
    result[frames] = own
    return result


def _as_around(weights: FloatArray, course: FloatArray) -> FloatArray:
    """Return weights (N, K) of the N frames of closings, interpolated from the frames around them.

    A lid that is half down closes from there, in the whole time of the closing.
    """
    around, outside = weights[course > 0], np.flatnonzero(course <= 0)
    if len(outside):
        for column, own in enumerate(weights[outside].T):
            around[:, column] = np.interp(np.flatnonzero(course > 0), outside, own)
    return around


def lowering(weights: FloatArray, apertures: LidApertures, free: BoolArray) -> FloatArray:
    """Return the shares (F,) by which the lower lid gives way where lids cross.

    Shut lids that are parted stay open in part if the lower lid is raised unevenly. Where they look
    open (`looks_open`), shapes that raise the lower lid give way, as far as it takes.

    Parameters
    ----------
    weights : (F, T) float64
    apertures : LidApertures
    free : (T,) bool
        Blend shapes that may change.
    """
    return _lowering(weights, lower_until_parted(weights, apertures, free), apertures, free)


def part_crossed_lids(
    weights: FloatArray,
    apertures: LidApertures,
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
    apertures : LidApertures
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
    parted = lower_until_parted(weights, apertures, free)
    share = _faded(
        _lowering(weights, parted, apertures, free) if share is None else share, fade, even
    )
    frames = np.flatnonzero(share)
    if len(frames):
        parted[frames] = _lowered(weights[frames], share[frames], apertures, free)
    return parted


def _lowering(
    weights: FloatArray, parted: FloatArray, apertures: LidApertures, free: BoolArray
) -> FloatArray:
    """Return the shares (F,) that shapes which raise the lower lid lose, for lids to look shut."""
    share = np.zeros(len(weights))
    limit = looks_open(apertures)
    frames = np.flatnonzero((parted != weights).any(axis=1))
    before = apertures.widest(weights[frames])
    frames, before = frames[before < limit], before[before < limit]
    if not len(frames):
        return share

    def left(share: FloatArray) -> FloatArray:
        return apertures.widest(_lowered(weights[frames], share, apertures, free))

    wide = apertures.widest(parted[frames])
    # Shut lids are to look shut; the further they were parted before, the less it counts.
    shut = 1.0 - (before / limit).clip(min=0.0)
    allowed = wide + shut * (limit - wide).clip(max=0.0)
    allowed = np.maximum(allowed, left(np.ones(len(frames))) + _EXACT)
    share[frames] = _bisected(lambda share: left(share) <= allowed, len(frames))
    return share


def _lowered(
    weights: FloatArray, share: FloatArray, apertures: LidApertures, free: BoolArray
) -> FloatArray:
    """Return weights at which the lower lid gave way, and the upper lid came down in its place.

    The upper lid comes down until the lids are as near as before, or meet. So how far it was down
    in a frame does not count where the lids cross: its noise would go into the lower lid.
    """
    squeezers = [k for k in {*apertures.tighteners, *apertures.cheek_raisers} if free[k]]
    own = weights.copy()
    own[:, squeezers] *= 1.0 - share[:, None]
    if free[apertures.closer] and squeezers:
        own[:, apertures.closer] = np.maximum(own[:, apertures.closer], 1.0)
        nearest = np.maximum(apertures.least(weights), -_PRESSED * apertures.opening)
        own = _scaled(own, np.array([apertures.closer]), apertures, nearest)
    return lower_until_parted(own, apertures, free)


def _faded(share: FloatArray, frames: int, even: EvenTimes | None) -> FloatArray:
    """Return shares (F,) that rise and fall over some frames, and are no less anywhere."""
    if frames < 2 or not share.any():
        return share
    shares = share if even is None else even.resampled(share)
    faded = hann_envelope(shares, frames)
    faded = faded if even is None else even.of_frames(faded)
    return np.asarray(np.maximum(share, (faded - _UNSEEN) / (1.0 - _UNSEEN)))


def lower_until_parted(weights: FloatArray, apertures: LidApertures, free: BoolArray) -> FloatArray:
    """Lower the closing shape's weight, then all movers', until the lids do not cross."""
    result = weights.copy()
    movers = np.flatnonzero(apertures.movers & free)
    for columns in (np.intersect1d(movers, [apertures.closer]), movers):
        frames = np.flatnonzero(crossing(result, apertures) > _EXACT)
        if len(frames) and len(columns):
            nearest = np.full(len(frames), -_PRESSED * apertures.opening)
            result[frames] = _scaled(result[frames], columns, apertures, nearest)
    return result


def looks_open(apertures: LidApertures) -> float:
    """Return the aperture at the widest place from which shut lids look open [m]."""
    alone = np.zeros((1, len(apertures.movers)))
    alone[:, apertures.closer] = _least_weight(alone, [apertures.closer], apertures)
    return max(_OPEN * apertures.opening, _ALONE * float(apertures.widest(alone)[0]))


def crossing(weights: FloatArray, apertures: LidApertures) -> FloatArray:
    """Return by how much the lids cross beyond the allowed depth (`_PRESSED`): (F,) [m]."""
    return by_blocks(
        len(weights), lambda frames: _crossed(apertures.at(weights[frames]), apertures)
    )


def _crossed(distances: FloatArray, apertures: LidApertures) -> FloatArray:
    return np.asarray(np.maximum(-_PRESSED * apertures.opening - distances.min(axis=1), 0.0))


def _least_weight(weights: FloatArray, columns: list[int], apertures: LidApertures) -> FloatArray:
    """Return the least weight (F,) of some columns at which the lids meet; 1 if they never do."""
    ends = weights.copy(), weights.copy()
    for end, value in zip(ends, (0.0, 1.0), strict=True):
        end[:, columns] = value
    between = apertures.between(*ends)

    def met(weight: FloatArray) -> BoolArray:
        least, widest = apertures.ends_of(between(weight))
        return np.asarray((least <= -_PRESSED * apertures.opening) | (widest <= 0.0))

    return _bisected(met, len(weights))


def _scaled(
    weights: FloatArray, columns: IntArray, apertures: LidApertures, nearest: FloatArray
) -> FloatArray:
    """Return weights with some columns scaled down until no aperture is less than `nearest` [m]."""
    lowest = weights.copy()
    lowest[:, columns] = 0.0
    between = apertures.between(weights, lowest)
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
