"""The motions that rules of a face are designed by: its expressions, and other movements."""

from dataclasses import dataclass

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.rule_design.movements import Movements

__all__ = ["FaceMotions"]


@dataclass(frozen=True, eq=False, slots=True)
class FaceMotions:
    """The features of a face, and the poses and movements that they are compared in.

    Attributes
    ----------
    evaluator : BlendShapeEvaluator
        Of the features, N = I.
    upper : (I,) bool
        Features of markers above the nose tip.
    twins : (I,) int64
        The feature on the other side; itself where there is none.
    poses : (E, S) float64
        All expression poses.
    movements : Movements
    """

    evaluator: BlendShapeEvaluator
    upper: BoolArray
    twins: IntArray
    poses: FloatArray
    movements: Movements

    def __post_init__(self) -> None:
        freeze(self, "poses")

    def features(self, weights: FloatArray) -> FloatArray:
        """Return the features at weights (N, S): (N, I) [m]."""
        return self.evaluator.displacements(self.evaluator.combined(weights))
