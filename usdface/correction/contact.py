"""Contact: limits a correction so that closed lips and lids neither part nor intersect.

Where an aperture (`usdface.correction.apertures`) would change beyond its limits, the weights that
change it are reduced by as little as possible (least squares, in closed form but for the number of
weights that end at 0), in many frames at once.

Without inbetweens and combination shapes, apertures are linear in the weights. Otherwise the same
is done with the slopes of the secant from the solved to the reduced weights, which give the change
of each aperture exactly, until every aperture is within its limits; then as much of the last step
is undone as the limits allow (bisection).
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.correction.apertures import Apertures
from usdface.numerics.frame_blocks import frame_blocks

__all__ = ["limit_correction"]

# Upper bounds: a handful of rounds, and as many steps as weights reach 0 on the way.
_ROUNDS = 20
_STEPS = 12
# Bisections: 1e-6 of a weight, which moves a lip by far less than `_EXACT`.
_HALVINGS = 20
# [m]: far below the visible.
_EXACT = 1e-6
# Frames at a time; results do not depend on it. Slopes of 14 apertures by 270 blend shapes have 8
# MB.
_BLOCK = 256


def limit_correction(
    solved: FloatArray, corrected: FloatArray, apertures: Apertures
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Reduce a correction by as little as keeps the contact of lips and lids.

    Every weight stays between the solved and the corrected one.

    Parameters
    ----------
    solved, corrected : (F, T) float64
    apertures : Apertures

    Returns
    -------
    reduced : (F, T) float64
        Equal to `corrected` where no aperture is beyond its limits.
    limited : (F, K) bool
        Apertures that `corrected` would change beyond their limits ...
    excess : (F, K) float64 [m]
        ... and by how much.
    """
    before = apertures.at(solved)
    low, high = apertures.limits(before)
    change = apertures.change(solved, corrected)
    excess = np.maximum(change - high, low - change).clip(min=0.0)
    limited = excess > _EXACT
    frames = np.flatnonzero(limited.any(axis=1))
    reduced = np.array(corrected)
    if len(frames):
        active = (corrected[frames] != solved[frames]).any(axis=0) & apertures.evaluator.moving
        for part in frame_blocks(len(frames), _BLOCK):
            at = frames[part]
            block = np.ix_(at, np.flatnonzero(active))
            aperture_change = _ApertureChange(apertures, solved[at], np.flatnonzero(active))
            reduced[block] = solved[block] + _limited_change(
                corrected[block] - solved[block], aperture_change, low[at], high[at]
            )
    return reduced, limited, excess


@dataclass(frozen=True, eq=False, slots=True)
class _ApertureChange:
    """Changes of the apertures by changes (N, S) of the active weights: those that move one.

    Attributes
    ----------
    apertures : Apertures
    solved : (N, T) float64
    active : (S,) int64
    """

    apertures: Apertures
    solved: FloatArray
    active: IntArray

    def of(self, delta: FloatArray) -> FloatArray:
        """Return the change (N, K) [m]."""
        if self.apertures.evaluator.linear:
            return np.asarray(delta @ self.apertures.evaluator.offsets[self.active])
        return self.apertures.change(self.solved, self._corrected(delta))

    def slopes(self, delta: FloatArray) -> FloatArray:
        """Return the change of each aperture per change of each weight: (N, S, K) [m]."""
        if self.apertures.evaluator.linear:
            moves = self.apertures.evaluator.offsets[self.active]
            return np.broadcast_to(moves, (len(delta), *moves.shape))
        return self.apertures.slopes(self.solved, self._corrected(delta))[:, self.active]

    def _corrected(self, delta: FloatArray) -> FloatArray:
        corrected = self.solved.copy()
        corrected[:, self.active] += delta
        return corrected


def _limited_change(
    requested: FloatArray, change: _ApertureChange, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return d (N, S) near to `requested`, between 0 and it, with low <= change.of(d) <= high.

    `low` <= 0 <= `high`, (N, K): 0 is always allowed. Each aperture reduces the weights that work
    against it, and a weight gets the strongest reduction of all apertures. Weights are only
    reduced, so the iteration ends; it is symmetric in left and right.
    """
    delta, rejected = requested.copy(), requested.copy()
    for _ in range(_ROUNDS):
        aperture = change.of(delta)
        over = np.maximum(aperture - high, low - aperture) > _EXACT
        if not over.any():
            break
        rejected[over.any(axis=1)] = delta[over.any(axis=1)]
        slopes = change.slopes(delta)
        smallest = delta.copy()
        for k in np.flatnonzero(over.any(axis=0)):
            rows = np.flatnonzero(over[:, k])
            # Signs as if the aperture were too wide.
            direction = np.where(aperture[rows, k] > 0, 1.0, -1.0)[:, None] * slopes[rows, :, k]
            limit = np.where(aperture[rows, k] > 0, high[rows, k], -low[rows, k])
            projected = _project(delta[rows], direction, limit)
            smallest[rows] = np.where(
                np.abs(projected) < np.abs(smallest[rows]), projected, smallest[rows]
            )
        delta = smallest
    if change.apertures.evaluator.linear:
        return delta * _largest_factor(change.of(delta), low, high)[:, None]
    return _bisect_last_step(delta, rejected, change, low, high)


def _bisect_last_step(
    delta: FloatArray,
    rejected: FloatArray,
    change: _ApertureChange,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return the last allowed changes (N, S) on the segment from `delta` to `rejected`.

    On the segment from 0 to `delta` where `delta` itself is not allowed.
    """

    def allowed(candidate: FloatArray, slack: float) -> BoolArray:
        aperture = change.of(candidate)
        over = np.maximum(aperture - high, low - aperture)
        return np.asarray((over <= slack).all(axis=1, keepdims=True))

    accepted = allowed(delta, _EXACT)
    inside, outside = np.where(accepted, delta, 0.0), np.where(accepted, rejected, delta)
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2
        # Half the slack: the result must pass the same check again despite rounding.
        accepted = allowed(middle, _EXACT / 2)
        inside, outside = np.where(accepted, middle, inside), np.where(accepted, outside, middle)
    return inside


def _project(requested: FloatArray, direction: FloatArray, limit: FloatArray) -> FloatArray:
    """Project weights (least squares) so that they open an aperture by at most `limit` (N,).

    `direction` (N, S) is the motion of the aperture by each weight. Newton's steps on the one
    multiplier approach the solution from below, because the aperture is convex in it.
    """
    part = direction * requested
    opening = part > 0
    size = np.abs(direction)
    closing = np.where(opening, 0.0, part).sum(axis=1)
    multiplier = np.zeros(len(requested))
    for _ in range(_STEPS):
        remaining = np.where(
            opening, np.maximum(np.abs(requested) - multiplier[:, None] * size, 0.0), 0.0
        )
        over = (remaining * size).sum(axis=1) + closing - limit
        slope = np.where(remaining > 0, size**2, 0.0).sum(axis=1)
        step = np.zeros(len(requested))
        np.divide(over, slope, out=step, where=(over > 0) & (slope > 0))
        if not step.any():
            break
        multiplier += step
    remaining = np.where(
        opening, np.maximum(np.abs(requested) - multiplier[:, None] * size, 0.0), 0.0
    )
    return np.where(opening, np.copysign(remaining, requested), requested)


def _largest_factor(aperture: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the largest factor in [0, 1] that keeps apertures (N, K) within bounds: (N,).

    The bounds are widened by the tolerance: rounding in an aperture that may not change must not
    block all other motion.
    """
    allowed = np.where(aperture > 0, high, -low) + _EXACT
    factor = np.ones(aperture.shape)
    np.divide(allowed, np.abs(aperture), out=factor, where=np.abs(aperture) > allowed)
    return np.asarray(factor.min(axis=1, initial=1.0))
