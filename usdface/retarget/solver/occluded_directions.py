"""Directions of a space that occluded coordinates decide, for each pattern of visible ones.

An occluded coordinate is no evidence: of the displacements of a frame, the part along these
directions is left out, and there are so many degrees of freedom fewer.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dsyevr, dtrtri

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.numerics.visibility_patterns import visibility_patterns

__all__ = ["NOTHING", "OccludedDirections"]

# Relative singular value below which directions count as 0: two blend shapes that move the markers
# alike differ by the rounding of a file, 10 nm, and the rank must not depend on that. Head motions
# are as long as a turn by a radian, so for blend shapes of the ICT face this is 6 micrometres.
NOTHING = 1e-5
# Squared singular value from which a direction is clearly none of these: then normal equations,
# whose rounding errors are 1e-16, find it to 1e-10.
_CLEAR = 1e-6
# Numbers that are kept for later evaluations, a bound on memory: 16 MB. Where patterns need more,
# the directions are found again each time.
_KEPT = 2e6


# A factor (R, H) of the projector onto a span, and the span's rank. Where nothing is beyond it, the
# factor may have no columns.
_Span = tuple[FloatArray, int]


@dataclass(frozen=True, eq=False, slots=True)
class OccludedDirections:
    """The occluded directions of K frames.

    Attributes
    ----------
    basis : (N, R) float64
        Orthonormal, of the whole space.
    patterns : (P, N) bool
        Coordinates that are visible, distinct; none where no coordinate is ever occluded.
    frames : list of (L,) int64
        Those that have each pattern.
    kept : list of ((R, H) float64, int) or None
        The span of the directions that each pattern hides, as a factor of the projector onto it,
        and its rank; None where these are too large.
    """

    basis: FloatArray
    patterns: BoolArray
    frames: list[IntArray]
    kept: list[_Span] | None

    @classmethod
    def of(cls, basis: FloatArray, seen: BoolArray) -> "OccludedDirections":
        """Return those of frames that show the coordinates `seen` (K, N)."""
        if seen.all():
            return cls(basis, seen[:0], [], [])
        patterns, which = visibility_patterns(seen)
        frames = [np.flatnonzero(which == k) for k in range(len(patterns))]
        return cls(basis, patterns, frames, _kept(_spans(basis, patterns)))

    def squares(self, rest: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return squares summed beyond the occluded directions, and degrees of freedom: (K,), (K,).

        Parameters
        ----------
        rest : (K, R) float64
            Coordinates of each frame in `basis`.
        """
        sums = (rest**2).sum(axis=1)
        count = np.full(len(rest), rest.shape[1])
        spans = _spans(self.basis, self.patterns) if self.kept is None else self.kept
        for frames, (occluded, rank) in zip(self.frames, spans, strict=True):
            sums[frames] -= ((rest[frames] @ occluded) ** 2).sum(axis=1)
            count[frames] -= rank
        sums[count == 0] = 0.0
        return sums.clip(min=0.0), count


def _spans(basis: FloatArray, patterns: BoolArray) -> Iterable[_Span]:
    """Yield the span of the directions that each pattern (P, N) hides."""
    return (_span(basis[~pattern].T) for pattern in patterns)


def _kept(spans: Iterable[_Span]) -> list[_Span] | None:
    """Return a list of spans; None where they are more than `_KEPT` numbers."""
    kept, size = [], 0
    for span in spans:
        kept.append(span)
        size += span[0].size
        if size > _KEPT:
            return None
    return kept


def _span(columns: FloatArray) -> _Span:
    """Return the span of the columns (R, H): explained directions add nothing to it.

    It is that of the left singular vectors of values above `NOTHING`. Where no value is near that,
    normal equations find it in a third of the time.
    """
    space, count = columns.shape
    narrow = columns if count < space else columns.T
    size = narrow.shape[1]
    if not size:
        return columns, 0
    normal = narrow.T @ narrow
    inverse = _inverse_factor(normal)
    # Its square is the sum of the reciprocals of the squared singular values.
    if inverse is not None and np.vdot(inverse, inverse) < 1.0 / _CLEAR:
        return (columns @ inverse.T if count < space else np.zeros((space, 0))), size
    squared, vectors, found, _, failed = dsyevr(normal, range="V", vl=-1.0, vu=_CLEAR)
    if not failed and squared[:found].max(initial=0.0) <= NOTHING**2:
        without = vectors[:, :found] @ vectors[:, :found].T
        if count >= space:
            return np.eye(space) - without, size - found
        inverse = _inverse_factor(normal + without)
        if inverse is not None:
            return (columns - columns @ without) @ inverse.T, size - found
    directions, values, _ = np.linalg.svd(columns, full_matrices=False)
    directions = directions[:, values > NOTHING]
    return directions, directions.shape[1]


def _inverse_factor(normal: FloatArray) -> FloatArray | None:
    """Return the inverse of the Cholesky factor (H, H) of a matrix; None where it has none."""
    factor, failed = dpotrf(normal, lower=True)
    if failed:
        return None
    inverse, failed = dtrtri(factor, lower=True)
    return None if failed else np.asarray(inverse)
