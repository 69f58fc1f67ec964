"""Noise of the markers, and misfit between face and rig.

Both are measured on the part of the displacements that no weight and no pose explains. An occluded
marker is no evidence of either: its coordinates are left out of each frame, which has fewer degrees
of freedom, and their values are ignored.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.geometry.marker_spread import rms_radius
from usdface.numerics.robust_deviation import THIRD_DIFFERENCE
from usdface.numerics.visibility_patterns import visibility_patterns
from usdface.retarget.solver.noise import NEIGHBOURS, white_noise
from usdface.retarget.solver.occluded_directions import NOTHING, OccludedDirections
from usdface.retarget.solver.seen_directions import SeenDirections

__all__ = ["EXPRESSIVE_QUANTILE", "ResidualSpace"]

# Misfit grows with the expression and is 0 at neutral. It is measured at this quantile of the
# frames, so that neither a neutral face nor a few swapped markers decide.
EXPRESSIVE_QUANTILE = 0.9
# Least squared misfit, as a share of the standard error of a variance of so many coordinates. At 0
# nothing but the learned covariance would hold weights that resemble each other. On the first half
# of the recorded curves (python -m benchmarks.solve) weights with 0, 0.3 and 1 are off by 0.0374,
# 0.0363 and 0.0361 on MakeHuman's face, with 41 markers by 0.0365, 0.0347 and 0.0349, where a fifth
# of the markers is occluded by 0.0249, 0.0249 and 0.0257.
_LEAST_MISFIT = 0.3
# Patterns of occlusion that are used, and numbers that are stored for them: bounds on time and
# memory. Where a take has more, evenly spread frames are used.
_PATTERNS = 400
_NUMBERS = 4e6
# Coordinates of which a basis is made, of as many columns: 72 MB. Of more, as where a scan's points
# are markers, 20,000 would take 29 GB; the rest of each frame is found without it.
_BASIS = 3000
# Noise is the unexplained part of this share of the frames, the stillest: what moves there is noise
# alone. With 0.05 instead of 0.5 weights of these performers are off by at most 1 % more, by 2 to
# 6 % more where frames are interpolated, and a rest before a blink (AnimFace's Eyebrows) shows at
# most 0.097 of a weight instead of 0.118.
_STILL = 0.05
# By this share the variance of such noise may be off. Of 0, 0.05 and 0.1 on the same.
_UNCERTAIN = 0.05


@dataclass(frozen=True, eq=False, slots=True)
class ResidualSpace:
    """The space of displacements that neither weights nor head pose explain.

    Attributes
    ----------
    basis : (N, R) float64 or None
        Orthonormal basis of the space if all markers are visible; None of very many coordinates.
    explained : (N, N - R) float64
        Orthonormal basis of the others.
    seen : (F, N) bool
        Coordinates that were observed.
    frames : (K,) int64
        Frames that are used.
    occluded : OccludedDirections or SeenDirections
        The occluded directions in these frames; without a basis the seen ones.
    lags : tuple of int
        Frames after which errors are independent (`independent_lags`).
    windows : dict of int to _Windows
        The same directions in third differences, by lag, as far as noise has been measured:
        rounds measure that of the same frames again.
    """

    basis: FloatArray | None
    explained: FloatArray
    seen: BoolArray
    frames: IntArray
    occluded: OccludedDirections | SeenDirections
    lags: tuple[int, ...] = (NEIGHBOURS,)
    windows: dict[int, "_Windows"] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(
        cls, explained: FloatArray, seen: BoolArray, lags: tuple[int, ...] = (NEIGHBOURS,)
    ) -> "ResidualSpace":
        """Return the complement of the span of `explained` (K, N), of coordinates `seen` (F, N)."""
        has_basis = explained.shape[1] <= _BASIS
        turned, values, _ = np.linalg.svd(explained.T, full_matrices=has_basis)
        rank = int((values > NOTHING * values.max(initial=0.0)).sum())
        span, basis = turned[:, :rank], turned[:, rank:] if has_basis else None
        used = span if basis is None else basis
        if seen.all() or rank == len(turned):
            every = _directions(basis, span, np.ones_like(seen))
            return cls(basis, span, seen, np.arange(len(seen)), every, lags)
        most = max(16, int(min(_PATTERNS, _NUMBERS / max(used.size, 1))))
        frames = np.flatnonzero(seen.any(axis=1))
        while len(visibility_patterns(seen[frames])[0]) > most:
            frames = frames[::2]
        return cls(basis, span, seen, frames, _directions(basis, span, seen[frames]), lags)

    @classmethod
    def beside_head(
        cls,
        directions: FloatArray,
        rigid: FloatArray,
        rest: FloatArray,
        seen: BoolArray,
        lags: tuple[int, ...],
    ) -> "ResidualSpace":
        """Return the complement of blend shapes and small head motions.

        Parameters
        ----------
        directions : (K, N) float64 [m]
            Displacements by the blend shapes.
        rigid : (N, 6) float64
            Orthonormal head motions; (N, 0) of a head that is known.
        rest : (M, 3) float64 [m]
            The markers at rest.
        seen, lags
            As the attributes.
        """
        turn = np.sqrt(len(rest)) * rms_radius(rest)
        return cls.of(np.vstack([directions, turn * rigid.T]), seen, lags)

    @property
    def dimension(self) -> int:
        """Of the space, if all markers are visible."""
        size, rank = self.explained.shape
        return int(size - rank)

    def _coordinates(self, observed: FloatArray) -> FloatArray:
        """Return displacements (K, N) as `occluded` measures them: in the basis, or as they are."""
        return observed if self.basis is None else observed @ self.basis

    def squares(self, observed: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the mean square [m^2] of frames, and its degrees of freedom: (K,), (K,).

        Parameters
        ----------
        observed : (F, N) float64 [m]
            Displacements; any number where they were not seen.
        """
        sums, count = self.occluded.squares(self._coordinates(observed[self.frames]))
        enough = count > 0
        return sums[enough] / count[enough], count[enough]

    def noise(self, observed: FloatArray) -> float:
        """Estimate the noise of marker coordinates: standard deviation [m].

        White noise is the same between neighbouring frames and at the larger `lags`; that of a
        filtered or interpolated take is larger between the latter. Of few markers, whose
        displacements weights and pose explain all, it is that of the displacements themselves:
        their slow motion is dropped like misfit. 0 if there are too few frames.
        `observed` as in `squares`.
        """
        if len(observed) < 4:
            return 0.0
        found = self._unexplained_noise(observed, NEIGHBOURS) if self.dimension else None
        if found is None:
            return white_noise(np.where(self.seen, observed, np.nan))
        others = [self._unexplained_noise(observed, lag) for lag in self.lags]
        return max(found, min((other for other in others if other is not None), default=0.0))

    def least_misfit(self, observed: FloatArray, noise: float) -> float:
        """Return the misfit [m] that noise which is not white may hide: its variance is less sure.

        `observed` as in `squares`, `noise` [m] as estimated from it.
        """
        if self.lags == (NEIGHBOURS,) or not self.dimension:
            return 0.0
        white = self._unexplained_noise(observed, NEIGHBOURS)
        if white is None:  # then noise is estimated as white
            return 0.0
        return float(np.sqrt(2.0 * _UNCERTAIN * max(noise**2 - white**2, 0.0)))

    def _unexplained_noise(self, observed: FloatArray, lag: int) -> float | None:
        """Return the noise of the unexplained part; None where gaps leave nothing of it.

        By differences of frames at this lag. As `white_noise`, by the median length of third
        differences, or where these span motion by that of the stillest frames (`_STILL`): unlike
        the median of their coordinates it is the same in every basis, whatever the order of markers
        and blend shapes.
        """
        if len(observed) <= 3 * lag:
            return None
        rest = self._coordinates(observed)
        first, second, third, fourth = (rest[k * lag : len(rest) - (3 - k) * lag] for k in range(4))
        differences = fourth - first + 3.0 * (second - third)
        windows = self._windows_of(lag)
        sums, count = windows.occluded.squares(differences[windows.frames])
        enough = count > 0
        if not enough.any():
            return None
        # A quantile of a sum of squares of as many normal numbers. The stillest of n frames is that
        # of 1 / (n + 1), so few frames give no smaller quantile.
        share = 0.5 if lag == NEIGHBOURS else max(_STILL, 1.0 / (np.count_nonzero(enough) + 1))
        variances = sums[enough] / chdtri(count[enough], 1.0 - share)
        return float(np.sqrt(np.quantile(variances, share, method="weibull") / THIRD_DIFFERENCE))

    def _windows_of(self, lag: int) -> "_Windows":
        """Return the third differences of frames that are a `lag` apart."""
        if lag not in self.windows:
            four = np.lib.stride_tricks.sliding_window_view(self.seen, 3 * lag + 1, axis=0)
            seen: BoolArray = np.asarray(four[..., ::lag].all(axis=-1))
            used = self.frames[self.frames < len(seen)]
            used = used[seen[used].any(axis=1)]
            directions = _directions(self.basis, self.explained, seen[used])
            self.windows[lag] = _Windows(used, directions)
        return self.windows[lag]

    def misfit(self, observed: FloatArray, noise: float) -> float:
        """Estimate by how much face and rig differ.

        Parameters
        ----------
        observed : (F, N) float64 [m]
            As in `squares`.
        noise : float [m]

        Returns
        -------
        float [m]
            RMS over the coordinates of an expressive frame. Where noise explains it all, a share of
            what the take cannot distinguish from 0; 0 without noise.
        """
        squares, count = self.squares(observed)
        if not len(squares):
            return 0.0
        of_noise = noise**2 * chdtri(count, 1.0 - EXPRESSIVE_QUANTILE) / count
        least = _LEAST_MISFIT * noise**2 * float(np.sqrt(2.0 / count.sum()))
        return float(
            np.sqrt(max(least, float(np.quantile(squares - of_noise, EXPRESSIVE_QUANTILE))))
        )


@dataclass(frozen=True, eq=False, slots=True)
class _Windows:
    """Third differences that are used: the first frame (K,) and the directions of each."""

    frames: IntArray
    occluded: OccludedDirections | SeenDirections


def _directions(
    basis: FloatArray | None, explained: FloatArray, seen: BoolArray
) -> OccludedDirections | SeenDirections:
    """Return the occluded directions of frames in a basis; without one the seen ones."""
    if basis is None:
        return SeenDirections.of(explained, seen)
    return OccludedDirections.of(basis, seen)
