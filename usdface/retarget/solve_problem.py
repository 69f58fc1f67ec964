"""The problem of a joint solve: markers of some frames, the face they are solved on, a setup."""

from dataclasses import dataclass

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.rbf import SpaceMap
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["SolveProblem"]


@dataclass(frozen=True, eq=False, slots=True)
class SolveProblem:
    """Markers whose weights are sought, and the head pose if the setup requests it.

    Attributes
    ----------
    times : (F,) float64 [s]
    positions : (F, M, D) float64
        Of the performer's markers; NaN where occluded.
    target : (M, 3) float64 [m]
        Neutral feature points on the character.
    model : BlendShapeEvaluator
        Of their displacements by the blend shapes: S shapes, 3 M coordinates.
    space : SpaceMap
        From the performer's neutral (its centres) to `target`.
    pose : Pose
        A first guess, or the pose where it is known.
    setup : RetargetSetup
    names : tuple of str, length S
        The blend shapes; needed for pins, symmetry and gaze.
    least_noise : float [m]
        Standard deviation of a marker coordinate, as far as it is known before.
    """

    times: FloatArray
    positions: FloatArray
    target: FloatArray
    model: BlendShapeEvaluator
    space: SpaceMap
    pose: Pose
    setup: RetargetSetup
    names: tuple[str, ...] = ()
    least_noise: float = 0.0

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the blend shapes whose weights are free; none where `names` are not given."""
        return tuple(self.names[shape] for shape in self.model.free) if self.names else ()
