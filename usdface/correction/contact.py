"""Contact: a correction opens no closed mouth or eye, and pushes no lid or lip into the other.

Where a gap (`usdface.correction.gaps`) would change by more than it may, the weights that change it
are taken back, as little as possible (least squares, in closed form but for the number of weights
that end at 0), in all frames at once.

Of linear shapes gaps are linear in the weights. Inbetweens and combination shapes make them
nonlinear: then the same is done with the slopes of the chord from the solved weights to those that
are left, which give the change of each gap exactly, until no gap changes by more than it may; of
the last step so much is undone as the gaps themselves allow (bisection).
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.correction.gaps import Gaps

__all__ = ["limit_correction"]

# Upper bounds: a handful of rounds, and as many steps as weights reach 0 on the way.
_ROUNDS = 20
_STEPS = 12
# Bisections: 1e-6 of a weight, which moves a lip by far less than `_EXACT`.
_HALVINGS = 20
# [m]: far below what is seen.
_EXACT = 1e-6


def limit_correction(
    solved: FloatArray, corrected: FloatArray, gaps: Gaps
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Take back as little of a correction as keeps the contact of lips and lids.

    Every weight stays between the solved and the corrected one.

    Parameters
    ----------
    solved, corrected : (F, T) float64
    gaps : Gaps

    Returns
    -------
    held : (F, T) float64
        Equal to `corrected` where the contact is kept anyway.
    limited : (F, K) bool
        Where a gap would have changed by more than it may ...
    excess : (F, K) float64 [m]
        ... and by how much.
    """
    before = gaps.at(solved)
    low, high = gaps.room(before)
    change = gaps.change(solved, corrected)
    excess = np.maximum(change - high, low - change).clip(min=0.0)
    limited = excess > _EXACT
    frames = np.flatnonzero(limited.any(axis=1))
    held = np.array(corrected)
    if len(frames):
        concerned = (corrected[frames] != solved[frames]).any(axis=0) & gaps.moved_by
        block = np.ix_(frames, np.flatnonzero(concerned))
        change_of = _Change(gaps, solved[frames], np.flatnonzero(concerned))
        held[block] = solved[block] + _kept(
            corrected[block] - solved[block], change_of, low[frames], high[frames]
        )
    return held, limited, excess


@dataclass(frozen=True, eq=False, slots=True)
class _Change:
    """The change of the gaps by changes (N, S) of those weights that are concerned.

    Attributes
    ----------
    gaps : Gaps
    solved : (N, T) float64
    concerned : (S,) int64
    """

    gaps: Gaps
    solved: FloatArray
    concerned: IntArray

    def of(self, kept: FloatArray) -> FloatArray:
        """Return the change (N, K) [m]."""
        if self.gaps.evaluator.linear:
            return np.asarray(kept @ self.gaps.evaluator.offsets[self.concerned])
        return self.gaps.change(self.solved, self._corrected(kept))

    def slopes(self, kept: FloatArray) -> FloatArray:
        """Return how it is made up: (N, S, K) [m]."""
        if self.gaps.evaluator.linear:
            moves = self.gaps.evaluator.offsets[self.concerned]
            return np.broadcast_to(moves, (len(kept), *moves.shape))
        return self.gaps.slopes(self.solved, self._corrected(kept))[:, self.concerned]

    def _corrected(self, kept: FloatArray) -> FloatArray:
        corrected = self.solved.copy()
        corrected[:, self.concerned] += kept
        return corrected


def _kept(wanted: FloatArray, change: _Change, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return d (N, S) near to `wanted`, between 0 and it, with low <= change.of(d) <= high.

    `low` <= 0 <= `high`, (N, K): 0 is always allowed. Each place takes back what works against
    it, and a weight goes as far back as any place asks; since that only ever takes back, it
    comes to an end, and left and right are treated alike.
    """
    kept, refused = wanted.copy(), wanted.copy()
    for _ in range(_ROUNDS):
        gap = change.of(kept)
        over = np.maximum(gap - high, low - gap) > _EXACT
        if not over.any():
            break
        refused[over.any(axis=1)] = kept[over.any(axis=1)]
        slopes = change.slopes(kept)
        least = kept.copy()
        for k in np.flatnonzero(over.any(axis=0)):
            rows = np.flatnonzero(over[:, k])
            # Turned so that the gap is too wide.
            way = np.where(gap[rows, k] > 0, 1.0, -1.0)[:, None] * slopes[rows, :, k]
            most = np.where(gap[rows, k] > 0, high[rows, k], -low[rows, k])
            back = _projected(kept[rows], way, most)
            least[rows] = np.where(np.abs(back) < np.abs(least[rows]), back, least[rows])
        kept = least
    if change.gaps.evaluator.linear:
        return kept * _share(change.of(kept), low, high)[:, None]
    return _given_back(kept, refused, change, low, high)


def _given_back(
    kept: FloatArray, refused: FloatArray, change: _Change, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the last changes (N, S) that are allowed on the way from `kept` to `refused`.

    From 0 to `kept` where that is refused itself.
    """

    def allowed(tried: FloatArray, slack: float) -> BoolArray:
        gap = change.of(tried)
        over = np.maximum(gap - high, low - gap)
        return np.asarray((over <= slack).all(axis=1, keepdims=True))

    good = allowed(kept, _EXACT)
    inside, outside = np.where(good, kept, 0.0), np.where(good, refused, kept)
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2
        # Half the slack: the last bits must not make it too much when it is looked at again.
        good = allowed(middle, _EXACT / 2)
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    return inside


def _projected(wanted: FloatArray, way: FloatArray, most: FloatArray) -> FloatArray:
    """Take back as little as possible (least squares) of what moves a gap beyond `most` (N,).

    `way` (N, S) is the motion of the gap by each weight. Newton's steps on the one multiplier go
    up to the answer and never past it, because the gap falls ever more slowly.
    """
    part = way * wanted
    adding = part > 0
    size = np.abs(way)
    still = np.where(adding, 0.0, part).sum(axis=1)
    force = np.zeros(len(wanted))
    for _ in range(_STEPS):
        left = np.where(adding, np.maximum(np.abs(wanted) - force[:, None] * size, 0.0), 0.0)
        over = (left * size).sum(axis=1) + still - most
        slope = np.where(left > 0, size**2, 0.0).sum(axis=1)
        step = np.zeros(len(wanted))
        np.divide(over, slope, out=step, where=(over > 0) & (slope > 0))
        if not step.any():
            break
        force += step
    left = np.where(adding, np.maximum(np.abs(wanted) - force[:, None] * size, 0.0), 0.0)
    return np.where(adding, np.copysign(left, wanted), wanted)


def _share(gap: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the largest factor in [0, 1] that keeps gaps (N, K) within bounds: (N,).

    The bounds are taken as wide as is exact enough: the last bits of a gap that may not change
    must not stop all else.
    """
    room = np.where(gap > 0, high, -low) + _EXACT
    share = np.ones(gap.shape)
    np.divide(room, np.abs(gap), out=share, where=np.abs(gap) > room)
    return np.asarray(share.min(axis=1, initial=1.0))
