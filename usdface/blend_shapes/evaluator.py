"""Displacements of vertices by blend shape weights, with inbetweens and combination shapes.

A combination shape has no weight of its own: it is the product, or the least, of its
parents' weights.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shapes.combination_weight import CombinationWeight
from usdface.blend_shapes.inbetween_path import InbetweenPath

__all__ = ["BlendShapeEvaluator", "shape_places"]


def shape_places(names: Sequence[str], shape_names: Sequence[str]) -> IntArray:
    """Return the place of each name among the shapes of an evaluator, -1 = none: (T,) int64."""
    places = {name: place for place, name in enumerate(shape_names)}
    return np.array([places.get(name, -1) for name in names], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class BlendShapeEvaluator:
    """S blend shapes, of which P have a weight of their own, at N coordinates.

    Attributes
    ----------
    offsets : (S, N) float64 [m]
        Displacement by each shape at weight 1.
    inbetweens : tuple of InbetweenPath
        Of the shapes that have inbetweens.
    combinations : tuple of CombinationWeight
        Of the combination shapes, parents before those that build on them.
    limits : (L, 2) int64
        Shapes whose weight never exceeds that of another: of both, the place among all shapes.
    """

    offsets: FloatArray
    inbetweens: tuple[InbetweenPath, ...] = ()
    combinations: tuple[CombinationWeight, ...] = ()
    limits: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))

    @cached_property
    def free(self) -> IntArray:
        """Shapes with a weight of their own: (P,)."""
        combined = [combination.shape for combination in self.combinations]
        return np.setdiff1d(np.arange(len(self.offsets)), combined)

    @property
    def linear(self) -> bool:
        """Whether displacements are linear in the weights."""
        return not (self.inbetweens or self.combinations)

    @property
    def moving(self) -> BoolArray:
        """Whether each weight moves anything, combination shapes by their parents: (S,)."""
        moving = np.asarray(self.offsets.any(axis=1))
        for path in self.inbetweens:
            moving[path.shape] |= path.displacements.any()
        for combination in reversed(self.combinations):
            moving[combination.parents] |= moving[combination.shape]
            moving[combination.shape] = False
        return moving

    @property
    def limit_rows(self) -> FloatArray:
        """Inequalities of the free weights, ``limit_rows @ w <= 0``: (C, P)."""
        both = np.isin(self.limits, self.free).all(axis=1)
        places = np.searchsorted(self.free, self.limits[both])
        rows = np.zeros((len(places), len(self.free)))
        rows[np.arange(len(places)), places[:, 0]] = 1.0
        rows[np.arange(len(places)), places[:, 1]] = -1.0
        return rows

    @property
    def directions(self) -> FloatArray:
        """Displacements of all shapes and all segments of their inbetweens: (K, N) [m]."""
        return np.vstack([self.offsets, *(path.displacements for path in self.inbetweens)])

    def mapped(self, function: Callable[[FloatArray], FloatArray]) -> "BlendShapeEvaluator":
        """Return the evaluator of a linear function of the coordinates, (..., N) to (..., K)."""
        paths = (replace(p, displacements=function(p.displacements)) for p in self.inbetweens)
        return replace(self, offsets=function(self.offsets), inbetweens=tuple(paths))

    def select(self, coordinates: IntArray) -> "BlendShapeEvaluator":
        """Return the evaluator of some of the coordinates."""
        return self.mapped(lambda values: values[:, coordinates])

    def reordered(self, shapes: IntArray) -> "BlendShapeEvaluator":
        """Return the evaluator for weights in another order.

        Parameters
        ----------
        shapes : (T,) int64
            The shape of each column of the weights, by `shape_places`; -1 = not in this evaluator.
            The weight of a shape without a column is 0.
        """
        known = np.flatnonzero(shapes >= 0)
        place = dict(zip(shapes[known].tolist(), known.tolist(), strict=True))
        offsets = np.zeros((len(shapes), self.offsets.shape[1]))
        offsets[known] = self.offsets[shapes[known]]
        still: set[int] = set()  # combination shapes that lack a parent
        combinations = []
        for combination in self.combinations:
            parents = [place.get(parent) for parent in combination.parents.tolist()]
            if combination.shape not in place:
                continue
            if None in parents or still.intersection(combination.parents.tolist()):
                still.add(combination.shape)
                continue
            shape = place[combination.shape]
            combinations.append(replace(combination, shape=shape, parents=np.array(parents)))
        offsets[[place[shape] for shape in still]] = 0.0
        paths = tuple(
            replace(path, shape=place[path.shape])
            for path in self.inbetweens
            if path.shape in place and path.shape not in still
        )
        limits = [pair for pair in self.limits.tolist() if set(pair) <= place.keys()]
        moved = np.array([[place[low], place[high]] for low, high in limits], np.int64)
        return BlendShapeEvaluator(offsets, paths, tuple(combinations), moved.reshape(-1, 2))

    def complete(self, weights: FloatArray) -> FloatArray:
        """Return the weights of all shapes (F, S) for those of the free ones (F, P)."""
        result = np.zeros((len(weights), len(self.offsets)))
        result[:, self.free] = weights
        for combination in self.combinations:
            result[:, combination.shape] = combination.of(result)
        return result

    def combined(self, weights: FloatArray) -> FloatArray:
        """Return weights (F, S) in which combination shapes follow their parents."""
        return self.complete(weights[:, self.free]) if self.combinations else weights

    def displacements(self, weights: FloatArray) -> FloatArray:
        """Return the displacements from neutral by complete weights (F, S): (F, N) [m]."""
        result = weights @ self.offsets
        for path in self.inbetweens:
            own = weights[:, path.shape]
            result += path.at(own) - np.outer(own, self.offsets[path.shape])
        return np.asarray(result)

    def from_linear(self, weights: FloatArray) -> FloatArray:
        """Return weights (F, S) that move about as far as linear ones, along the inbetweens.

        For first guesses, or small weights, of a linear solve: inbetweens count by their projection
        on their shape; combination shapes follow their parents.
        """
        result = weights.copy()
        for path in self.inbetweens:
            result[:, path.shape] = path.weights_of(weights[:, path.shape])
        return self.combined(result)

    def gradient(self, weights: FloatArray, residuals: FloatArray) -> FloatArray:
        """Return J'r for the free weights, J the Jacobian of `displacements`: (F, P).

        Parameters
        ----------
        weights : (F, S) float64
            Complete.
        residuals : (F, N) float64
            r of every frame.
        """
        result = residuals @ self.offsets.T
        frames = np.arange(len(residuals))
        for path in self.inbetweens:
            along = residuals @ path.slopes.T
            result[:, path.shape] = along[frames, path.stretch(weights[:, path.shape])[0]]
        for combination in reversed(self.combinations):
            passed = result[:, combination.shape, None] * combination.slopes(weights)
            for column, parent in enumerate(combination.parents):
                result[:, parent] += passed[:, column]
        return np.asarray(result[:, self.free])

    def secants(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return the mean Jacobian of the free weights along segments between weights: (F, P, N).

        With it, ``displacements(end) - displacements(start)`` is exactly the sum over the free
        shapes of their changes times their slopes.

        Parameters
        ----------
        start, end : (F, S) float64
            Complete.
        """
        result = np.repeat(self.offsets[None], len(start), axis=0)
        for path in self.inbetweens:
            result[:, path.shape] = path.secants(start[:, path.shape], end[:, path.shape])
        for combination in reversed(self.combinations):
            slopes = combination.secants(start, end)
            for column, parent in enumerate(combination.parents):
                result[:, parent] += slopes[:, column, None] * result[:, combination.shape]
        return np.asarray(result[:, self.free])
