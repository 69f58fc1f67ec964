"""The path of a blend shape with inbetweens over its weight.

It is linear from one inbetween to the next, and extrapolated beyond the outer ones.

Source: OpenUSD, UsdSkel "Blend Shapes" (inbetweens); `UsdSkel.BlendShapeQuery` in 26.11 for the
weights beyond the outer ones.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.blend_shape import BlendShape, Inbetween

__all__ = ["InbetweenPath", "distinct_inbetweens", "inbetween_path"]

# Change of a weight below which a secant is replaced by the slope of the path: rounding (1e-16)
# over it stays below 1e-7 of the shape's displacement.
_SAME = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class InbetweenPath:
    """The piecewise linear path of one shape, through neutral, its inbetweens and itself.

    Attributes
    ----------
    shape : int
        Its place among the shapes.
    weights : (K,) float64
        Of the knots, rising; 0 and 1 are among them.
    displacements : (K, N) float64 [m]
        At the knots.
    """

    shape: int
    weights: FloatArray
    displacements: FloatArray

    def hats(self, weights: FloatArray) -> FloatArray:
        """Return the influence of each knot at some weights (F,): (F, K), rows of sum 1.

        Two neighbours have influence at a time; beyond the outer knots the last segment is
        extrapolated.
        """
        segment, part = self.stretch(weights)
        hats = np.zeros((len(weights), len(self.weights)))
        frames = np.arange(len(weights))
        hats[frames, segment] = 1.0 - part
        hats[frames, segment + 1] = part
        return hats

    def at(self, weights: FloatArray) -> FloatArray:
        """Return the displacements at some weights (F,): (F, N) [m]."""
        return np.asarray(self.hats(weights) @ self.displacements)

    def knots_between(self, low: float, high: float) -> FloatArray:
        """Return the knots of the path over the weights from `low` to `high`: (C, N) [m]."""
        inner = self.displacements[(self.weights > low) & (self.weights < high)]
        return np.concatenate([inner, self.at(np.array([low, high]))])

    def secants(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return the slopes of the secants from weights (F,) to others: (F, N) [m]."""
        change = end - start
        apart = np.abs(change) > _SAME
        chord = (self.at(end) - self.at(start)) / np.where(apart, change, 1.0)[:, None]
        return np.where(apart[:, None], chord, self.slopes[self.stretch(end)[0]])

    def weights_of(self, shares: FloatArray) -> FloatArray:
        """Return the weights (F,) at which the path, projected on the whole shape, is at `shares`.

        The first ones, where there are several; within the knots. The shares themselves, if the
        whole shape moves nothing.
        """
        whole = self.displacements[self.weights == 1][0]
        size = float(whole @ whole)
        if not size > 0:
            return shares
        along = self.displacements @ whole / size
        return np.interp(shares, np.maximum.accumulate(along), self.weights)

    def shares_of(self, weights: FloatArray) -> FloatArray:
        """Return the projection of the path on the whole shape at some weights (F,): (F,) [1].

        The weights themselves, if the whole shape moves nothing.
        """
        whole = self.displacements[self.weights == 1][0]
        size = float(whole @ whole)
        return np.asarray(self.at(weights) @ whole / size) if size > 0 else weights

    @property
    def slopes(self) -> FloatArray:
        """Slope of each segment: (K - 1, N) [m]."""
        return np.asarray(np.diff(self.displacements, axis=0) / np.diff(self.weights)[:, None])

    def stretch(self, weights: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the segment of each weight (F,), at a knot the one before, and its share of it."""
        last = len(self.weights) - 2
        segment = (np.searchsorted(self.weights, weights) - 1).clip(0, last)
        left, right = self.weights[segment], self.weights[segment + 1]
        return segment, (weights - left) / (right - left)


def distinct_inbetweens(shape: BlendShape) -> tuple[Inbetween, ...]:
    """Return the inbetweens by weight; of several at one weight, or at 0 or 1, the first counts."""
    weights = {0.0, 1.0}
    distinct = []
    for between in shape.inbetweens:
        if np.isfinite(between.weight) and between.weight not in weights:
            weights.add(between.weight)
            distinct.append(between)
    return tuple(sorted(distinct, key=lambda between: between.weight))


def inbetween_path(shape: BlendShape, number: int = 0) -> InbetweenPath:
    """Return the path of a shape at its own vertices, N = 3 len(shape.indices)."""
    between = distinct_inbetweens(shape)
    knots = [0.0, 1.0, *(b.weight for b in between)]
    offsets = [np.zeros_like(shape.offsets), shape.offsets, *(b.offsets for b in between)]
    order = np.argsort(knots)
    return InbetweenPath(
        number, np.array(knots)[order], np.array(offsets)[order].reshape(len(knots), -1)
    )
