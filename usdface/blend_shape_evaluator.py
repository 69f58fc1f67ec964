"""What weights do to the markers: inbetweens and combination shapes, not only straight lines.

A shape with inbetweens goes straight from one to the next and on beyond the outer ones, as in
UsdSkel. A combination shape has no weight of its own: it is the product, or the least, of its
parents' weights.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.rigs import BlendShape, Mesh

__all__ = [
    "BlendShapeEvaluator",
    "Curve",
    "Product",
    "combinations_of",
    "evaluator_of",
    "with_combinations",
]


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """The path of one shape: `values` (K, N) [m] at the weights `places` (K,), rising."""

    shape: int
    places: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Product:
    """A combination shape: its weight is the product of its parents', or the `least` of them."""

    shape: int
    parents: IntArray
    least: bool

    def weight(self, weights: FloatArray) -> FloatArray:
        """Return its weight (F,) where all shapes have `weights` (F, S)."""
        own = weights[:, self.parents]
        return np.asarray(own.min(axis=1) if self.least else own.prod(axis=1))

    def slopes(self, weights: FloatArray) -> FloatArray:
        """Return the change of its weight with each parent's: (F, K)."""
        own = weights[:, self.parents]
        count = own.shape[1]
        if self.least:
            return np.asarray(np.arange(count) == own.argmin(axis=1)[:, None], np.float64)
        others = [np.delete(own, k, axis=1).prod(axis=1) for k in range(count)]
        return np.stack(others, axis=1)


@dataclass(frozen=True, eq=False)
class BlendShapeEvaluator:
    """S blend shapes of which P have a weight of their own, seen at N marker coordinates.

    Attributes
    ----------
    shapes : (S, N) float64 [m]
        What each adds at weight 1.
    curves : tuple of Curve
        Of the shapes that have inbetweens.
    products : tuple of Product
        Combination shapes, parents before those that build on them.
    limits : (L, 2) int64
        Shapes whose weight never exceeds that of another: of both, the place among all shapes.
    """

    shapes: FloatArray
    curves: tuple[Curve, ...] = ()
    products: tuple[Product, ...] = ()
    limits: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))

    @cached_property
    def free(self) -> IntArray:
        """Shapes with a weight of their own: (P,)."""
        made = [product.shape for product in self.products]
        return np.setdiff1d(np.arange(len(self.shapes)), made)

    @property
    def straight(self) -> bool:
        """Whether the markers follow the weights linearly."""
        return not (self.curves or self.products)

    @property
    def rows(self) -> FloatArray:
        """Inequalities of the free weights, ``rows @ w <= 0``: (C, P)."""
        both = np.isin(self.limits, self.free).all(axis=1)
        places = np.searchsorted(self.free, self.limits[both])
        rows = np.zeros((len(places), len(self.free)))
        rows[np.arange(len(places)), places[:, 0]] = 1.0
        rows[np.arange(len(places)), places[:, 1]] = -1.0
        return rows

    @property
    def directions(self) -> FloatArray:
        """All that shapes can add, on whatever way: (K, N) [m]."""
        return np.vstack([self.shapes, *(curve.values for curve in self.curves)])

    def at(self, coordinates: IntArray) -> "BlendShapeEvaluator":
        """Return the model of some of the marker coordinates."""
        curves = (replace(c, values=c.values[:, coordinates]) for c in self.curves)
        return replace(self, shapes=self.shapes[:, coordinates], curves=tuple(curves))

    def complete(self, weights: FloatArray) -> FloatArray:
        """Return the weights of all shapes (F, S) for those of the free ones (F, P)."""
        result = np.zeros((len(weights), len(self.shapes)))
        result[:, self.free] = weights
        for product in self.products:
            result[:, product.shape] = product.weight(result)
        return result

    def explained(self, weights: FloatArray) -> FloatArray:
        """Return where complete weights (F, S) bring the markers, from neutral: (F, N) [m]."""
        result = weights @ self.shapes
        for curve in self.curves:
            own = weights[:, curve.shape]
            place, part = _between(curve, own)
            hats = np.zeros((len(own), len(curve.places)))
            frames = np.arange(len(own))
            hats[frames, place] = 1.0 - part
            hats[frames, place + 1] = part
            result += hats @ curve.values - np.outer(own, self.shapes[curve.shape])
        return np.asarray(result)

    def pulled(self, weights: FloatArray, forces: FloatArray) -> FloatArray:
        """Return J'r for the free weights: (F, P), J the change of `explained` at `weights`.

        Parameters
        ----------
        weights : (F, S) float64
            Complete.
        forces : (F, N) float64
            r of every frame.
        """
        result = forces @ self.shapes.T
        for curve in self.curves:
            place, _ = _between(curve, weights[:, curve.shape])
            slopes = np.diff(curve.values, axis=0) / np.diff(curve.places)[:, None]
            along = forces @ slopes.T
            result[:, curve.shape] = along[np.arange(len(along)), place]
        for product in reversed(self.products):
            passed = result[:, product.shape, None] * product.slopes(weights)
            for column, parent in enumerate(product.parents):
                result[:, parent] += passed[:, column]
        return np.asarray(result[:, self.free])


def _between(curve: Curve, weights: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the stretch of the path that each weight lies on, and where on it."""
    place = (np.searchsorted(curve.places, weights) - 1).clip(0, len(curve.places) - 2)
    left, right = curve.places[place], curve.places[place + 1]
    return place, (weights - left) / (right - left)


def evaluator_of(mesh: Mesh, points: IntArray) -> tuple[BlendShapeEvaluator, list[Finding]]:
    """Return what the shapes of a mesh do to its vertices `points` (M,), N = 3 M.

    Returns
    -------
    BlendShapeEvaluator
    list of Finding
        COMBINATION_IGNORED for shapes that build on what is not there, or on themselves.
    """
    names = {name: i for i, name in enumerate(mesh.shape_names)}
    curves = tuple(
        _curve(number, shape, mesh, points)
        for number, shape in enumerate(mesh.shapes)
        if shape.inbetweens
    )
    products: list[Product] = []
    limits: list[tuple[int, int]] = []
    findings: list[Finding] = []
    declared = {s.name: s.combination for s in mesh.shapes if s.combination is not None}
    for name, combination in declared.items():
        unknown = [parent for parent in combination.of if parent not in names]
        if unknown or name in combination.of or not combination.of:
            message = (
                f"it builds on {unknown[0]!r}" if unknown else "it builds on itself or nothing"
            )
            findings.append(finding("COMBINATION_IGNORED", name, message))
        elif combination.rule == "limit":
            limits += [(names[name], names[parent]) for parent in combination.of]
        else:
            parents = np.array([names[parent] for parent in combination.of])
            products.append(Product(names[name], parents, combination.rule == "min"))
    ordered, circular = _ordered(products)
    findings += [
        finding("COMBINATION_IGNORED", mesh.shape_names[p.shape], "it builds on itself or nothing")
        for p in circular
    ]
    offsets = mesh.offsets_at(points).reshape(len(mesh.shapes), -1)
    return (
        BlendShapeEvaluator(offsets, curves, ordered, np.array(limits, np.int64).reshape(-1, 2)),
        findings,
    )


def combinations_of(model: BlendShapeEvaluator, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the shapes that have no weight of their own."""
    return tuple(names[product.shape] for product in model.products)


def with_combinations(mesh: Mesh, names: tuple[str, ...], weights: FloatArray) -> FloatArray:
    """Return weights (F, T) of shapes `names` in which combination shapes follow their parents."""
    model, _ = evaluator_of(mesh, np.zeros(0, np.int64))
    if not model.products or not set(mesh.shape_names) <= set(names):
        return weights
    columns = [names.index(name) for name in mesh.shape_names]
    result = weights.copy()
    result[:, columns] = model.complete(weights[:, columns][:, model.free])
    return result


def _ordered(products: list[Product]) -> tuple[tuple[Product, ...], list[Product]]:
    """Return those that can be computed one after the other, and those in a ring."""
    waiting, ordered = list(products), []
    while waiting:
        open_shapes = {product.shape for product in waiting}
        ready = [p for p in waiting if open_shapes.isdisjoint(p.parents.tolist())]
        if not ready:
            break
        ordered += ready
        waiting = [p for p in waiting if p not in ready]
    return tuple(ordered), waiting


def _curve(number: int, shape: BlendShape, mesh: Mesh, points: IntArray) -> Curve:
    places = [0.0, 1.0, *(between.weight for between in shape.inbetweens)]
    parts = [np.zeros((len(points), 3)), *([np.zeros((len(points), 3))] * (len(places) - 1))]
    for k, offsets in enumerate([shape.offsets, *(b.offsets for b in shape.inbetweens)], 1):
        one = replace(mesh, shapes=(BlendShape(shape.name, shape.indices, offsets),))
        parts[k] = one.offsets_at(points)[0]
    order = np.argsort(places, kind="stable")
    values = np.array(parts).reshape(len(places), -1)
    return Curve(number, np.array(places)[order], values[order])
