"""Squares beyond explained directions, of so many coordinates that no basis of the rest is made.

The same as by `OccludedDirections` in a basis of the directions that are not explained: that has
as many columns as coordinates, these are as few as blend shapes.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.numerics.visibility_patterns import visibility_patterns
from usdface.retarget.solver.occluded_directions import NOTHING

__all__ = ["SeenDirections"]


@dataclass(frozen=True, eq=False, slots=True)
class SeenDirections:
    """The explained directions as K frames show them.

    Attributes
    ----------
    span : (N, R) float64
        Orthonormal, of the explained directions.
    patterns : (P, N) bool
        Coordinates that are visible, distinct.
    frames : list of (L,) int64
        Those that have each pattern.
    factors : list of (R, H) float64
        Of each pattern: the visible rows of the span times this are orthonormal.
    """

    span: FloatArray
    patterns: BoolArray
    frames: list[IntArray]
    factors: list[FloatArray]

    @classmethod
    def of(cls, span: FloatArray, seen: BoolArray) -> "SeenDirections":
        """Return those of frames that show the coordinates `seen` (K, N)."""
        patterns, which = visibility_patterns(seen)
        frames = [np.flatnonzero(which == k) for k in range(len(patterns))]
        return cls(span, patterns, frames, [_factor(span[pattern]) for pattern in patterns])

    def squares(self, values: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return squares summed beyond the directions, and degrees of freedom: (K,), (K,).

        Parameters
        ----------
        values : (K, N) float64
            Of the coordinates; any number where they are not visible.
        """
        sums, count = np.zeros(len(values)), np.zeros(len(values), dtype=np.int64)
        for pattern, frames, factor in zip(self.patterns, self.frames, self.factors, strict=True):
            own = values[frames][:, pattern]
            shown = self.span[pattern]
            own -= ((own @ shown) @ factor) @ factor.T @ shown.T
            count[frames] = own.shape[1] - factor.shape[1]
            sums[frames] = (own**2).sum(axis=1) if own.shape[1] > factor.shape[1] else 0.0
        return sums, count


def _factor(shown: FloatArray) -> FloatArray:
    """Return the factor (R, H) of some rows (L, R) of a span; H is their rank.

    A direction that only occluded coordinates have is 0 in the others, as by `NOTHING`.
    """
    _, values, turned = np.linalg.svd(shown, full_matrices=False)
    kept = values > NOTHING
    return np.asarray(turned[kept].T / values[kept])
