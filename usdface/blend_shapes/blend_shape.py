"""Blend shapes: sparse, with inbetweens and combinations, as immutable arrays in metres."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError
from usdface.numerics.matching_rows import matching_rows
from usdface.short_repr import short_repr

__all__ = ["BlendShape", "Combination", "CombinationRule", "Inbetween", "offsets_at"]

CombinationRule = Literal["product", "min", "limit"]


@dataclass(frozen=True, eq=False, slots=True)
class Inbetween:
    """A shape on the way to (or beyond) its blend shape, reached at `weight` (not 0, not 1).

    `offsets` (N, 3) [m] belong to the blend shape's `indices`; `normal_offsets` likewise.
    """

    name: str
    weight: float
    offsets: FloatArray
    normal_offsets: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "offsets", "normal_offsets")


@dataclass(frozen=True, slots=True)
class Combination:
    """The rule by which the weight of a combination shape follows those of its parents.

    `rule` "product" or "min": it is the product, or the least, of theirs, and has no value of its
    own. "limit": it has, but never exceeds any of theirs.
    """

    of: tuple[str, ...]
    rule: CombinationRule = "product"


@checked
@dataclass(frozen=True, eq=False, slots=True)
class BlendShape:
    """One sparse blend shape.

    Attributes
    ----------
    name : str
        The original name, any text; it is the UsdSkel token and the glTF target name.
    indices : (N,) int64
        Vertices it moves, sorted, unique.
    offsets : (N, 3) float64 [m]
        Displacement at weight 1.
    normal_offsets : (N, 3) float64 [1] or None
        Change of the vertex normal at weight 1.
    inbetweens : tuple of Inbetween
    label : str
        The name it had where it comes from, if `name` is another to be unique; else "".
    combination : Combination or None
        None: its weight is free.

    Examples
    --------
    >>> shape = usdface.BlendShape("jawOpen", [3, 8], [[0, -0.02, 0], [0, -0.01, 0]])
    >>> shape.offsets.shape
    (2, 3)
    """

    __repr__ = short_repr

    name: str
    indices: IntArray
    offsets: FloatArray
    normal_offsets: FloatArray | None = None
    inbetweens: tuple[Inbetween, ...] = ()
    label: str = ""
    combination: Combination | None = None

    def __post_init__(self) -> None:
        freeze(self, "indices", dtype=np.int64)
        freeze(self, "offsets", "normal_offsets")
        count = self.indices.shape
        if len(count) != 1 or self.offsets.shape != (*count, 3):
            raise InputError(
                f"blend shape {self.name!r} has offsets of shape {self.offsets.shape} "
                f"for indices of shape {count}"
            )
        if (np.diff(self.indices) <= 0).any():
            raise InputError(f"blend shape {self.name!r}: indices must be sorted and unique")

    @classmethod
    def from_dense(cls, name: str, offsets: FloatArray, tolerance: float = 0.0) -> "BlendShape":
        """Make a sparse shape of dense `offsets` (V, 3) [m]; smaller ones are left out."""
        indices = np.flatnonzero((np.abs(offsets) > tolerance).any(axis=1))
        return cls(name, indices, offsets[indices])

    def scaled(self, factor: float) -> "BlendShape":
        """Return the shape of a mesh that is `factor` times as large."""
        inbetweens = (replace(each, offsets=factor * each.offsets) for each in self.inbetweens)
        return replace(self, offsets=factor * self.offsets, inbetweens=tuple(inbetweens))


def offsets_at(shapes: tuple[BlendShape, ...], vertices: IntArray) -> FloatArray:
    """Return the offsets of shapes of a mesh at some of its vertices: (S, len(vertices), 3) [m].

    Vertices may be repeated.
    """
    result = np.zeros((len(shapes), len(vertices), 3))
    for row, shape in zip(result, shapes, strict=True):
        where, rows = matching_rows(shape.indices, vertices)
        row[where] = shape.offsets[rows]
    return result
