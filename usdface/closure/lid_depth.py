"""How deep pulses of the lids go: blinks close the eye, squints and glances do not.

Two curves measure how much of the opening between the lids is gone: an estimate from the markers
(`lid_estimate`), which follows fast blinks fully but takes a squint for half a blink, and the
solved blend shapes (`solved_lids`), which distinguish the two but follow a fast blink only in part.
On a real face, whose lids move unlike the rig's, the solve may show no closing at all: it is used
only for pulses that are less deep than the take's others, and for the shape by which lids close.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.closure.eye_closing import EyeClosing
from usdface.closure.lid_pulses import APART, lid_pulses
from usdface.numerics.ramps import linear_ramp

__all__ = [
    "LidDepth",
    "as_deep_as_others",
    "closed_as_solved",
    "has_closed_level",
    "lid_depth",
    "pulses_that_close",
]

# Shares of the opening that are gone in a closed eye at least: of the whole, as lids of a performer
# who moves them less than the rig, and of that of the take's blinks. Of 416 recorded closed eyes on
# other persons 0.46 and more, and 0.58 of the blinks; of two real takes 0.35, and 0.56; of lids
# that came back from wide open 0.29 at most.
_GONE, _GONE_OF_BLINKS = 0.25, 0.5
# A pulse that takes away less than this share of what the take's blinks do (upper quartile) is a
# ripple on lids that hang: 0.30 on one of three heads in a real take, whose blinks take 0.46 and
# more.
_LEAST_OF_BLINKS = 0.38
# A pulse that takes away as much of the opening as the take's other blinks (upper quartile), and at
# least the third share, is one of them, though less is gone where markers are bound to wrong
# places. Blinks of two real takes on three heads, with vertices that were proposed, 0.74 to 1.26,
# and 0.13 gone and more; half a blink of the recording 0.45 to 0.67 (0.89 in one of ten worlds);
# with both lid markers bound 3 mm too low a real take's blinks take away 0.21 and more, one of one
# eye with proposed vertices 0.199. In takes whose pulses do not tell the level (`_SWEPT`) none is:
# quick squints are as large as each other.
_AS_FAR, _AWAY, _FAR = 0.7, 0.1, 0.15
# One that is as high as the others by the markers themselves, too, if the estimate has it take away
# such a share of what they do, in the eye that is closed further: filmed blinks of AnimFace's Jaw
# on ICT, of which 0.20 and 0.22 seem gone, 0.65 to 0.74.
_TAKEN = 0.64
# Where the solve shows the take's blinks (upper quartile) by the second share of the opening or
# more, a pulse that is solved less deep than the third share of them leaves the eye open; below the
# first the solve is not used, between them in part. Of 198 recorded blinks 0.71 and more (all but
# one 0.75), of 26 pulses that leave an eye more than 35 % open 0.35 to 0.68 (two 0.71 and 0.77);
# blinks of a real take that the solve shows 0.80 and more. Others, shown by 0.1 to 0.35, are as
# little as 0.45 as deep as each other.
_HARDLY, _SHOWN, _AS_DEEP = 0.3, 0.5, 0.7
# Pulses that do not tell the level of a closed eye may all be squints. They are not where the blend
# shape that closes the eye does so much of what is solved (median of the pulses): of 26 takes of
# four persons with blinks and 41 markers 0.72 and more, with squints and glances in their place
# 0.66 at most. Else each has to take away so much of the opening (mean of the eyes): of ten takes
# of four persons recorded blinks 0.69 and more (one 0.64), 25 pulses that leave an eye more than
# 35 % open 0.48 to 0.66 (four 0.70 to 0.74).
_BY_CLOSER, _CLOSED = 0.69, 0.68
# An eye is held closed only in a take whose blinks take away so much of the opening: geometric mean
# of the share of all of it, and of the share of the most that is ever gone, as lids may move less
# than the rig's. Of takes with blinks 0.33 to 0.61, of two real takes 0.48 and more; with fast
# squints and glances in their place 0.17 to 0.31 (more in noise).
_SWEPT = 0.25
# The same of the blend shape that closes the eye, by itself, as solved. Of 16 takes with blinks on
# another person's ICT face 0.175 to 0.5, with squints and glances in their place 0.10 to 0.155.
_SWEPT_BY_CLOSER = 0.165


@dataclass(frozen=True, eq=False, slots=True)
class LidDepth:
    """How much of the opening of each eye is gone, smoothed; infinite where that is not known.

    Attributes
    ----------
    gone : (F, 2) float64
    most : (F, 2) float64
        The most that is gone around a frame.
    swept : (F, 2) float64
        How much a pulse around a frame takes away.
    """

    gone: FloatArray
    most: FloatArray
    swept: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "gone", "most", "swept")


def lid_depth(curve: FloatArray, step: float) -> LidDepth:
    """Smooth a curve (F, 2) of how much of the opening is gone.

    It is NaN in all frames of an eye that is not measured. `step` [s] is between two frames.
    """
    gone, most, swept = (np.full(curve.shape, np.inf) for _ in range(3))
    around = 2 * round(APART / step) + 1
    for eye in np.flatnonzero(np.isfinite(curve).all(axis=0)).tolist():
        gone[:, eye], pulses, _ = lid_pulses(curve[:, eye], step)
        most[:, eye] = maximum_filter1d(gone[:, eye], around)
        swept[:, eye] = maximum_filter1d(pulses, around)
    return LidDepth(gone, most, swept)


def pulses_that_close(
    lids: LidDepth, peaks: IntArray, blinks: Sequence[EyeClosing], heights: FloatArray
) -> BoolArray:
    """Return which pulses end at closed lids by the estimate: (N,).

    Parameters
    ----------
    lids : LidDepth
    peaks : (N,) int64
        Frame index of each pulse's peak.
    blinks : sequence of EyeClosing, length N
    heights : (N,) float64
        Of the pulses of the markers, by that of the take's blinks: mean of the eyes.
    """
    most = _deeper_eye(lids.most[peaks])
    closed = most >= max(_GONE, _GONE_OF_BLINKS * _usual(most))
    swept = _swept_by_others(lids.swept[peaks])
    closed &= swept >= _LEAST_OF_BLINKS
    if len(peaks) and _sweep_far(lids.swept[peaks], lids.most, _SWEPT):
        as_far = _as_far(lids.swept[peaks], blinks) | ((swept >= _TAKEN) & (heights >= _AS_FAR))
        closed |= as_far & (most >= _AWAY)
    return np.asarray(closed)


def as_deep_as_others(solved: LidDepth, peaks: IntArray) -> BoolArray:
    """Return which pulses are solved as deep as the take's other blinks: (N,).

    All of them where the solve hardly shows any.

    Parameters
    ----------
    solved : LidDepth
        Of the solved blend shapes.
    peaks : (N,) int64
    """
    most, level, used = _solved_at(solved, peaks)
    return np.asarray(most >= used * _AS_DEEP * level)


def closed_as_solved(
    solved: LidDepth, by_closer: LidDepth, peaks: IntArray, blinks: Sequence[EyeClosing]
) -> BoolArray:
    """Return which pulses are solved as closed eyes, whatever the take's others are: (N,).

    All of them where the solve hardly shows any, and where the closing shape does most of them.

    Parameters
    ----------
    solved, by_closer : LidDepth
        Of all solved blend shapes, and of the one that closes the eye by itself.
    peaks : (N,) int64
    blinks : sequence of EyeClosing, length N
    """
    most, known = np.maximum(solved.most[peaks], 0.0), np.isfinite(solved.most[peaks])
    swept, closer = (np.where(known, each.swept[peaks], 0.0) for each in (solved, by_closer))
    share = closer.sum(axis=1) / np.maximum(swept.sum(axis=1), 1e-9)
    if np.median(share) >= _BY_CLOSER:
        return np.ones(len(peaks), dtype=bool)
    own = known & [[eye in blink.eyes for eye in (0, 1)] for blink in blinks]
    mean = np.where(own, most, 0.0).sum(axis=1) / np.maximum(own.sum(axis=1), 1)
    _, _, used = _solved_at(solved, peaks)
    return np.asarray(~own.any(axis=1) | (mean >= used * _CLOSED))


def has_closed_level(
    lids: LidDepth, solved: LidDepth, by_closer: LidDepth, peaks: IntArray
) -> bool:
    """Whether the lids' pulses are deep enough to define the level of a closed eye.

    Blinks span most of the lids' range in the take, and of the closing shape's; quick squints and
    glances do not.

    Parameters
    ----------
    lids : LidDepth
        By the estimate.
    solved, by_closer : LidDepth
        Of all solved blend shapes, and of the one that closes the eye by itself.
    peaks : (N,) int64
        Of the pulses.
    """
    return _sweep_far(lids.swept[peaks], lids.most, _SWEPT) and _sweep_far(
        by_closer.swept[peaks], solved.gone, _SWEPT_BY_CLOSER
    )


def _solved_at(solved: LidDepth, peaks: IntArray) -> tuple[FloatArray, float, float]:
    """Return what is solved as gone at peaks (N,), of the take's blinks, and its use, 0 to 1."""
    # A lid that is solved as wider than at rest is no evidence where none is solved as closing.
    most = np.maximum(_deeper_eye(solved.most[peaks]), 0.0)
    known = most[np.isfinite(most)]
    # Of few blinks the deepest, which may be a squeeze, does not count.
    level = min(np.quantile(known, 0.75), np.sort(known)[-2:][0]) if len(known) else 0.0
    return most, level, float(linear_ramp(np.asarray(level), _HARDLY, _SHOWN))


def _sweep_far(swept: FloatArray, gone: FloatArray, least: float) -> bool:
    """Whether pulses of depth `swept` (N, 2) span much of the range of `gone` (F, 2)."""
    known = np.isfinite(swept).all(axis=0)
    if not known.any():
        return True
    height = float(np.quantile(swept[:, known].max(axis=1), 0.75))
    low, high = np.quantile(gone[:, known].max(axis=1), [0.1, 0.99])
    return height**2 >= least**2 * float(high - low)


def _as_far(swept: FloatArray, blinks: Sequence[EyeClosing]) -> BoolArray:
    """Return which pulses of depth `swept` (N, 2) are about as deep as the others: (N,)."""
    known = np.isfinite(swept).all(axis=0)
    if not known.any():
        return np.zeros(len(swept), dtype=bool)
    swept = swept[:, known]
    share = swept / np.maximum(np.quantile(swept, 0.75, axis=0), 1e-9)
    alone = np.array([blink.guessed or len(blink.eyes) < 2 for blink in blinks])
    reached = np.where(alone, share.max(axis=1), share.mean(axis=1)) >= _AS_FAR
    return np.asarray(reached & (swept.max(axis=1) >= _FAR))


def _swept_by_others(swept: FloatArray) -> FloatArray:
    """Return depths of pulses `swept` (N, 2), in the deeper eye, by those of the others: (N,)."""
    most = _deeper_eye(swept)
    return np.asarray(most / max(_usual(most), 1e-9))


def _usual(depths: FloatArray) -> float:
    """Return the upper quartile of the known depths (N,); 0 where none is known."""
    known = depths[np.isfinite(depths)]
    return float(np.quantile(known, 0.75)) if len(known) else 0.0


def _deeper_eye(gone: FloatArray) -> FloatArray:
    """Return how much is gone of the opening of the eye that is closed further: (N,).

    An eye of which that is not known is ignored; infinite where it is known of neither.
    """
    known = np.isfinite(gone)
    most = np.where(known, gone, -np.inf).max(axis=1)
    return np.asarray(np.where(known.any(axis=1), most, np.inf))
