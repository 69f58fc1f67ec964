"""Tracking of dots from image to image, in one direction of time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.footage.dots import Dots
from usdface.footage.similarity import IDENTITY, Similarity, fit_similarity

__all__ = ["HIDDEN", "Followed", "follow", "nearest_distances"]

HIDDEN = -1

# Place of tracks that have not begun [px].
_AWAY = 1e6
# Share of the distance between neighbouring dots within which a dot is searched: at 30 images a
# second the fastest dot of a face moves by less than half of it, the head's motion apart.
_GATE = 0.4
# A faint dot is searched within this share of that.
_FAINT = 0.6
# Growth of that share per frame while a dot is occluded, and its limit.
_LONGER, _FARTHEST = 0.02, 0.6
# Weight of a change in size and height (logarithms) beside the squared distance over the gate.
_SIZE = 0.1
# Share of a velocity relative to the head that is kept in the next frame.
_INERTIA = 0.7
# Median distance to the nearest dot above which the head's shift is searched among all pairs; share
# of dots lost at a cut; largest shift; in spacings.
_LOST, _CUT, _SEARCH = 0.25, 0.35, 6.0
# A dot that is partly occluded, or merged with others, has no valid place. One that fills its
# ellipse is a single dot on stretched skin, however large, as on a closing lid: two discs side by
# side fill 0.89, as in `usdface.footage.finished_tracks`.
_WHOLE, _ONE = (0.45, 1.7), 0.93
# Images without dots over which the head's motion is extrapolated.
_BLIND = 3
# Area of a dot follows the track by this share a frame.
_ADAPT = 0.1
# A new track begins at a dot that is shaped like one.
_NEW_FILL, _NEW_ROUND, _NEW_AREA, _NEW_HEIGHT = (0.8, 1.25), 0.15, (0.1, 2.0), 0.25


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """Tracks through F frames.

    Attributes
    ----------
    dots : (F, T) int64
        Index of each track's dot among those of the frame; HIDDEN = none.
    cuts : tuple of int
        Frames before which there is a cut.
    """

    dots: IntArray
    cuts: tuple[int, ...]


def nearest_distances(places: FloatArray) -> FloatArray:
    """Return the distance (N,) of each place (N, 2) to the nearest other; inf if it is alone."""
    away = np.linalg.norm(places[:, None] - places, axis=2)
    np.fill_diagonal(away, np.inf)
    return np.asarray(away.min(axis=1, initial=np.inf))


class _Tracks:
    """The tracks at one frame: where they are expected, how they move, how large they are."""

    def __init__(self, dots: Dots, start: IntArray, places: FloatArray) -> None:
        seen = start >= 0
        self.places = places.copy()
        self.places[seen] = dots.centres[start[seen]]
        self.areas = np.full(len(start), float(np.median(dots.areas)) if len(dots) else 1.0)
        self.areas[seen] = dots.areas[start[seen]]
        self.heights = np.full(len(start), float(np.median(dots.heights)) if len(dots) else 1.0)
        self.heights[seen] = dots.heights[start[seen]]
        self.velocities = np.zeros_like(self.places)
        self.unseen = np.where(seen, 0, 1)
        self.motion: Similarity = IDENTITY
        self.dead = np.zeros(len(start), dtype=bool)

    def spacing(self) -> FloatArray:
        """Return the local spacing (T,) [px], within twice of the usual."""
        live = ~self.dead
        usual = np.full(len(self.places), 40.0)
        if live.sum() > 1:
            near = nearest_distances(self.places[live])
            middle = max(float(np.median(near)), 1.0)
            usual[live] = near.clip(0.4 * middle, 1.6 * middle)
        return usual

    def step(self, dots: Dots) -> tuple[IntArray, bool]:
        """Return the dot of each track (T,) in the next frame, and whether there was a cut."""
        spacing = self.spacing()
        # Tracks of the most recent image with dots.
        age = int(self.unseen[~self.dead].min(initial=1_000_000))
        seen = (self.unseen == age) & ~self.dead
        if age > _BLIND:
            self.motion = IDENTITY
        moved = self.motion(self.places)
        cut = False
        if len(dots) and seen.any():
            expected = moved
            moved, cut = self._found(dots, expected, spacing, seen)
            jumped = moved is not expected
            pairs = self._assigned(dots, moved + self.velocities, spacing, ~self.dead)
            for _ in range(2):
                sure = (pairs >= 0) & seen
                if sure.sum() < 2:
                    break
                fitted = fit_similarity(self.places[sure], dots.centres[pairs[sure]])
                moved = fitted(self.places)
                pairs = self._assigned(dots, moved + self.velocities, spacing, ~self.dead)
                self.motion = IDENTITY if jumped else fitted  # a jump is not extrapolated
        else:
            pairs = np.full(len(self.places), HIDDEN)
        self._update(dots, moved, pairs, spacing)
        return pairs, cut

    def _found(
        self, dots: Dots, moved: FloatArray, spacing: FloatArray, seen: BoolArray
    ) -> tuple[FloatArray, bool]:
        """Search for the head where it is not near its prediction."""
        usual = float(np.median(spacing))
        off = np.linalg.norm(moved[seen][:, None] - dots.centres, axis=2).min(axis=1)
        if np.median(off) < _LOST * usual:
            return moved, False
        best, shift = -1, np.zeros(2)
        steps = (dots.centres[None] - moved[seen][:, None]).reshape(-1, 2)
        steps = steps[np.linalg.norm(steps, axis=1) < _SEARCH * usual]
        for step in steps[:: max(1, len(steps) // 400)]:
            near = np.linalg.norm(moved[seen][:, None] + step - dots.centres, axis=2).min(axis=1)
            votes = int((near < _LOST * usual).sum())
            if votes > best:
                best, shift = votes, step
        if best >= _CUT * seen.sum():
            return moved + shift, False
        self.velocities[:] = 0.0
        return _laid_over(moved, seen, dots.centres), True

    def _assigned(
        self,
        dots: Dots,
        expected: FloatArray,
        spacing: FloatArray,
        live: BoolArray,
    ) -> IntArray:
        away = np.linalg.norm(expected[:, None] - dots.centres, axis=2)
        share = np.minimum(_GATE + _LONGER * self.unseen, _FARTHEST)
        gate = (share * spacing)[:, None] * np.where(dots.faint, _FAINT, 1.0)
        cost = (away / gate) ** 2
        grown = np.abs(np.log(dots.areas / self.areas[:, None]))
        grown += np.abs(np.log(dots.heights / self.heights[:, None]))
        cost = np.where((cost <= 1.0) & live[:, None], cost + _SIZE * grown, np.inf)
        # Visible ones take precedence over occluded ones.
        cost = cost + np.where(self.unseen > 0, 0.3, 0.0)[:, None]
        finite = np.isfinite(cost)
        rows, columns = linear_sum_assignment(np.where(finite, cost, 1e3))
        pairs = np.full(len(expected), HIDDEN)
        good = finite[rows, columns]
        pairs[rows[good]] = columns[good]
        return pairs

    def _update(self, dots: Dots, moved: FloatArray, pairs: IntArray, spacing: FloatArray) -> None:
        seen = pairs >= 0
        change = np.zeros_like(self.places)
        change[seen] = dots.centres[pairs[seen]] - moved[seen]
        ratio = np.ones(len(pairs))
        ratio[seen] = dots.areas[pairs[seen]] / self.areas[seen]
        one = ratio < _WHOLE[1]
        one[seen] |= dots.fills[pairs[seen]] > _ONE
        whole = seen & (ratio > _WHOLE[0]) & one
        calm = whole & (self.unseen == 0)
        blend = self.velocities + 0.5 * (change - self.velocities)
        self.velocities = np.where(calm[:, None], _INERTIA * blend, 0.0)
        # An occluded dot goes along with its neighbours.
        if whole.any() and not whole.all():
            apart = np.linalg.norm(moved[~whole][:, None] - moved[whole], axis=2)
            weight = 1.0 / (apart**2 + (0.5 * spacing[~whole][:, None]) ** 2)
            around = weight @ change[whole] / weight.sum(axis=1, keepdims=True)
            change[~whole] = around
        # One that has not begun is as far away as this; motions of others must not add up there.
        self.places = np.clip(moved + change, -_AWAY, _AWAY)
        self.areas[whole] *= ratio[whole] ** _ADAPT
        higher = dots.heights[pairs[whole]] / self.heights[whole]
        self.heights[whole] *= higher**_ADAPT
        self.unseen = np.where(seen, 0, self.unseen + 1)

    def born(self, dots: Dots, taken: IntArray) -> IntArray:
        """Begin tracks at dots that none has; return their indices."""
        usual = float(np.median(self.areas)) if len(self.areas) else 0.0
        height = float(np.median(self.heights)) if len(self.heights) else 0.0
        free = np.ones(len(dots), dtype=bool)
        free[taken] = False
        free &= ~dots.faint & (dots.fills > _NEW_FILL[0]) & (dots.fills < _NEW_FILL[1])
        free &= (dots.roundness > _NEW_ROUND) & (dots.heights > _NEW_HEIGHT * height)
        if usual:
            free &= (dots.areas > _NEW_AREA[0] * usual) & (dots.areas < _NEW_AREA[1] * usual)
        fresh = np.flatnonzero(free)
        count = len(fresh)
        self.places = np.concatenate([self.places, dots.centres[fresh]])
        self.velocities = np.concatenate([self.velocities, np.zeros((count, 2))])
        self.areas = np.concatenate([self.areas, dots.areas[fresh]])
        self.heights = np.concatenate([self.heights, dots.heights[fresh]])
        self.unseen = np.concatenate([self.unseen, np.zeros(count, dtype=int)])
        self.dead = np.concatenate([self.dead, np.zeros(count, dtype=bool)])
        return fresh


def _laid_over(places: FloatArray, seen: BoolArray, centres: FloatArray) -> FloatArray:
    """Bring tracks over the dots of another picture, by middle and size."""
    own, other = np.median(places[seen], axis=0), np.median(centres, axis=0)
    size = np.abs(places[seen] - own).mean() or 1.0
    scale = float(np.abs(centres - other).mean() / size)
    return np.asarray(other + scale * (places - own))


def follow(
    frames: Sequence[Dots],
    start: IntArray,
    places: FloatArray,
    births: bool = True,
) -> Followed:
    """Follow dots from the first of some frames to the last.

    The head's motion (shift, turn, scale) is taken out first, then each dot is expected where its
    own velocity takes it, and looked for within a share of the spacing of the dots.

    Parameters
    ----------
    frames : sequence of Dots, length F
    start : (M,) int64
        The dot of each track in the first frame, or HIDDEN.
    places : (M, 2) float64 [px]
        Where occluded ones are expected there.
    births : bool
        Whether dots that no track has begin tracks, which are appended.
    """
    tracks = _Tracks(frames[0], start, places)
    rows, begun, cuts = [start], [0] * len(start), []
    short: list[int] = []
    for number in range(1, len(frames)):
        dots = frames[number]
        pairs, cut = tracks.step(dots)
        if cut:
            cuts.append(number)
        # A track that was just begun and lost at once was none.
        lost = [track for track in short if tracks.unseen[track] > 2]
        tracks.dead[lost] = True
        short = [t for t in short if t not in lost and number - begun[t] < 6]
        if births and len(dots):
            fresh = tracks.born(dots, pairs[pairs >= 0])
            short += range(len(begun), len(begun) + len(fresh))
            begun += [number] * len(fresh)
            pairs = np.concatenate([pairs, fresh])
        rows.append(pairs)
    table = np.full((len(rows), len(begun)), HIDDEN)
    for number, row in enumerate(rows):
        table[number, : len(row)] = row
    return Followed(table, tuple(cuts))
