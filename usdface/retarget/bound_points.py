"""The points of a face that the markers of a take are bound to."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.dot_skin import DotSkin

__all__ = ["BoundPoints"]


@dataclass(frozen=True, eq=False, slots=True)
class BoundPoints:
    """B bound markers on the character: rest positions, and displacements by its blend shapes.

    Attributes
    ----------
    rest : (B, 3) float64 [m]
    shape_names : tuple of str, length S
    model : BlendShapeEvaluator
        Of their displacements, N = 3 B.
    """

    rest: FloatArray
    shape_names: tuple[str, ...]
    model: BlendShapeEvaluator

    def __post_init__(self) -> None:
        freeze(self, "rest")

    @classmethod
    def linear(
        cls, rest: FloatArray, offsets: FloatArray, shape_names: tuple[str, ...]
    ) -> "BoundPoints":
        """Return points that blend shapes move by `offsets` (S, B, 3) [m] at weight 1."""
        return cls(rest, shape_names, BlendShapeEvaluator(offsets.reshape(len(offsets), -1)))

    @classmethod
    def on_skin(cls, skin: DotSkin, shape_names: tuple[str, ...]) -> "BoundPoints":
        """Return the middles of dots on a skin."""
        return cls(skin.rest, shape_names, skin.marker_evaluator)

    @property
    def offsets(self) -> FloatArray:
        """Displacements by each blend shape at weight 1: (S, B, 3) [m]."""
        return self.model.offsets.reshape(len(self.model.offsets), -1, 3)

    def select(self, points: IntArray) -> "BoundPoints":
        """Return some of the points."""
        coordinates = (3 * points[:, None] + np.arange(3)).ravel()
        return replace(self, rest=self.rest[points], model=self.model.select(coordinates))
