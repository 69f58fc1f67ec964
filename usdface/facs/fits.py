"""The fit of displacements of the feature points to each movement."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.facs.movements import MOVEMENTS, POINTS, prototype
from usdface.facs.shape_claims import Claim

__all__ = ["SEEN", "Fits", "Reading", "fits_of"]

# Deviations of noise beyond which points have moved: one in 700 by chance.
SEEN = 3.0
_MIRRORED = {"L": "R", "R": "L", "": ""}
# Movements whose mirror image is another one.
_TURNED = {"61": "62", "30L": "30R", "mouth left": "mouth right"}
_TURNED |= {right: left for left, right in _TURNED.items()}


class Reading(NamedTuple):
    """The displacement of points along the directions of a movement.

    `mean` [mm of a human head], points that move farther counting more; the same in standard
    deviations of the noise; and that of each point [mm].
    """

    mean: float
    in_noise: float
    points: dict[str, float]


@dataclass(frozen=True, eq=False, slots=True)
class Fits:
    """Displacements of feature points compared with all movements.

    Attributes
    ----------
    candidates : tuple of Claim, length C
        Each movement of the whole face and of each half that can do it alone.
    live : (P,) bool
        Points that any displacement moves: a rig with still eyeballs is judged by its lids.
    moved : (S, D) float64 [mm]
        Coordinates of the live points.
    ways : (C, D) float64
        The same of each movement.
    cosines : (S, C) float64
        Between the two: the fits.
    """

    candidates: tuple[Claim, ...]
    live: BoolArray
    moved: FloatArray
    ways: FloatArray
    cosines: FloatArray

    @property
    def reaches(self) -> FloatArray:
        """The largest displacement of a live point in each movement: (C,)."""
        lengths = np.linalg.norm(self.ways.reshape(len(self.ways), -1, 3), axis=2)
        return np.asarray(lengths.max(axis=1, initial=0.0))

    def best(self, row: int, claims: Iterable[Claim]) -> int:
        """Return the candidate of some claims that fits best."""
        return max(map(self.candidates.index, claims), key=lambda k: float(self.cosines[row, k]))

    def mirror(self, candidate: int) -> int:
        """Return the candidate that the mirror image of one is; of a symmetric one, itself."""
        claim = self.candidates[candidate]
        movement = _TURNED.get(claim.movement, claim.movement)
        return self.candidates.index(Claim(movement, _MIRRORED[claim.side]))

    def apart(self, one: int, other: int) -> bool:
        """Return whether two candidates share no point."""
        first, second = (self.ways[k].reshape(-1, 3).any(axis=1) for k in (one, other))
        return not bool((first & second).any())

    def reading(self, row: int, candidate: int, noise: float) -> Reading:
        """Return how far the points of a candidate moved along its directions; noise in mm."""
        way = self.ways[candidate]
        lengths = np.linalg.norm(way.reshape(-1, 3), axis=1)
        if not lengths.any():
            return Reading(0.0, 0.0, {})
        along = (self.moved[row] * way).reshape(-1, 3).sum(axis=1)
        names = [point for point, live in zip(POINTS, self.live, strict=True) if live]
        points = {names[k]: float(along[k] / lengths[k]) for k in np.flatnonzero(lengths)}
        mean = float(along.sum() / lengths.sum())
        spread = noise * float(np.linalg.norm(lengths) / lengths.sum())
        return Reading(mean, mean / spread, points)


def fits_of(moved: FloatArray) -> Fits:
    """Return the fits of displacements (S, P, 3) [mm of a human head] of the `POINTS`."""
    candidates = tuple(
        Claim(movement.name, side)
        for movement in MOVEMENTS.values()
        for side in (("", "L", "R") if movement.paired else ("",))
    )
    live: BoolArray = np.asarray(moved.any(axis=(0, 2)))
    ways = np.array([prototype(MOVEMENTS[c.movement], c.side)[live].ravel() for c in candidates])
    flat = moved[:, live].reshape(len(moved), -1)
    lengths = np.linalg.norm(flat, axis=1)[:, None] * np.linalg.norm(ways, axis=1)
    cosines = np.divide(flat @ ways.T, lengths, out=np.zeros(lengths.shape), where=lengths > 0)
    return Fits(candidates, live, flat, ways, cosines)
