"""The motion model of a solve: blend shapes and the head move the markers."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_modes import motion_basis

__all__ = ["MotionModel"]


@dataclass(frozen=True, eq=False, slots=True)
class MotionModel:
    """The displacements that M markers can have.

    Attributes
    ----------
    points : (M, 3) float64 [m]
        Where they rest on the character.
    shapes : BlendShapeEvaluator
        Of their displacements by the blend shapes, N = 3 M.
    axes : int
        Of a marker: 2 in an image, which has no depth; else 3.
    moving_head : bool
        The head's pose is solved with the weights, so small motions of it are unknown.
    """

    points: FloatArray
    shapes: BlendShapeEvaluator
    axes: int
    moving_head: bool

    def __post_init__(self) -> None:
        freeze(self, "points")

    @classmethod
    def linear(
        cls, points: FloatArray, offsets: FloatArray, axes: int, moving_head: bool
    ) -> "MotionModel":
        """Return the model of shapes with `offsets` (S, M, 3) [m] at weight 1."""
        shapes = BlendShapeEvaluator(offsets.reshape(len(offsets), -1))
        return cls(points, shapes, axes, moving_head)

    @property
    def coordinates(self) -> IntArray:
        """The coordinates of all 3 M that are observed: (M * axes,)."""
        return np.arange(self.points.size).reshape(-1, 3)[:, : self.axes].ravel()

    def head_basis(self, errors: FloatArray | None = None) -> FloatArray:
        """Return an orthonormal basis of small head motions: (M * axes, 6), or (M * axes, 0).

        With the `errors` (M,) [1] of the markers, of the motions divided by them.
        """
        if not self.moving_head:
            return np.zeros((self.axes * len(self.points), 0))
        return motion_basis(self.points, self.axes, errors)
