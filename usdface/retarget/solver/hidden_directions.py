"""Directions of a space that occluded coordinates decide, for each pattern of visible ones.

An occluded coordinate is no evidence: of the displacements of a frame, the part along these
directions is left out, and there are so many degrees of freedom fewer.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.visibility_patterns import visibility_patterns

__all__ = ["NOTHING", "HiddenDirections"]

# Relative singular value below which directions count as 0: two blend shapes that move the markers
# alike differ by the rounding of a file, 10 nm, and the rank must not depend on that. Head motions
# are as long as a turn by a radian, so for blend shapes of the ICT face this is 6 micrometres.
NOTHING = 1e-5
# Numbers that are kept for later evaluations, a bound on memory: 16 MB. Where patterns need more,
# the directions are found again each time.
_KEPT = 2e6


@dataclass(frozen=True, eq=False, slots=True)
class HiddenDirections:
    """The occluded directions of K frames.

    Attributes
    ----------
    basis : (N, R) float64
        Orthonormal, of the whole space.
    patterns : (P, N) bool
        Coordinates that are visible, distinct; none where no coordinate is ever occluded.
    frames : list of (L,) int64
        Those that have each pattern.
    kept : list of (R, H) float64 or None
        An orthonormal basis of the directions that each pattern hides; None where it is too large.
    """

    basis: FloatArray
    patterns: BoolArray
    frames: list[IntArray]
    kept: list[FloatArray] | None

    @classmethod
    def of(cls, basis: FloatArray, seen: BoolArray) -> "HiddenDirections":
        """Return those of frames that show the coordinates `seen` (K, N)."""
        if seen.all():
            return cls(basis, seen[:0], [], [])
        patterns, which = visibility_patterns(seen)
        frames = [np.flatnonzero(which == k) for k in range(len(patterns))]
        return cls(basis, patterns, frames, _kept(_spans(basis, patterns)))

    def squares(self, rest: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return sums of squares beyond the hidden directions, and degrees of freedom: (K,), (K,).

        Parameters
        ----------
        rest : (K, R) float64
            Coordinates of each frame in `basis`.
        """
        sums = (rest**2).sum(axis=1)
        count = np.full(len(rest), rest.shape[1])
        spans = _spans(self.basis, self.patterns) if self.kept is None else self.kept
        for frames, hidden in zip(self.frames, spans, strict=True):
            sums[frames] -= ((rest[frames] @ hidden) ** 2).sum(axis=1)
            count[frames] -= hidden.shape[1]
        return sums.clip(min=0.0), count


def _spans(basis: FloatArray, patterns: BoolArray) -> Iterable[FloatArray]:
    """Yield an orthonormal basis (R, H) of the directions that each pattern (P, N) hides."""
    return (_span(basis[~pattern].T) for pattern in patterns)


def _kept(spans: Iterable[FloatArray]) -> list[FloatArray] | None:
    """Return a list of spans; None where they are more than `_KEPT` numbers."""
    kept, size = [], 0
    for span in spans:
        kept.append(span)
        size += span.size
        if size > _KEPT:
            return None
    return kept


def _span(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns (R, H): what is explained anyway adds none."""
    directions, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(directions[:, sizes > NOTHING])
