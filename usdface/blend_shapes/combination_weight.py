"""The weights of combination shapes: products, or the least, of their parents' weights."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["CombinationWeight", "in_order"]

# Squared change of the parents' weights below which it is rounding.
_STILL = 1e-18


@dataclass(frozen=True, eq=False, slots=True)
class CombinationWeight:
    """The weight of a combination shape: the product of its parents', or the `least` of them.

    `shape` and `parents` (K,) are places among the shapes.
    """

    shape: int
    parents: IntArray
    least: bool

    def of(self, weights: FloatArray) -> FloatArray:
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

    def secants(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return slopes A (F, K) with ``sum(A * change of the parents) = change of its weight``.

        The mean of the slopes along the segment; Gauss-Legendre quadrature is exact for products.
        Where another parent becomes the `least` on the way, the difference is shared in proportion
        to the changes.
        """
        places, shares = np.polynomial.legendre.leggauss(len(self.parents) // 2 + 1)
        mean = np.zeros((len(start), len(self.parents)))
        for place, share in zip((places + 1.0) / 2.0, shares / 2.0, strict=True):
            mean += share * self.slopes(start + place * (end - start))
        change = (end - start)[:, self.parents]
        off = self.of(end) - self.of(start) - (mean * change).sum(axis=1)
        size = (change**2).sum(axis=1)
        rest = np.divide(off, size, out=np.zeros(len(off)), where=size > _STILL)
        return np.asarray(mean + rest[:, None] * change)


def in_order(
    combinations: list[CombinationWeight],
) -> tuple[tuple[CombinationWeight, ...], list[CombinationWeight]]:
    """Return those that can be computed one after the other, and those in a ring."""
    waiting, ordered = list(combinations), []
    while waiting:
        open_shapes = {combination.shape for combination in waiting}
        ready = [c for c in waiting if open_shapes.isdisjoint(c.parents.tolist())]
        if not ready:
            break
        ordered += ready
        waiting = [c for c in waiting if c not in ready]
    return tuple(ordered), waiting
