"""The solution of a retarget: weights, head pose, residuals."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_fit import Pose
from usdface.options import HeadMode
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.neutral import on_plane
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Solution"]


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """The result of a retarget of markers: in space, in an image, or of a filmed head.

    Of markers in space `neutral` has three coordinates, and `pose` is in metres. In an image it has
    two, and the pose is in pixels and lies in the image; unless the take is of a head before one
    camera, `filmed`: then the pose is in the space of the character, in metres, and `neutral` is
    the face from far in front.

    Attributes
    ----------
    weights : WeightsTake
        (F, S), in [0, 1].
    pose : Pose
        Head pose relative to the neutral frames, in take space or that of `filmed`.
    residual : (F,) float64 [m]
        RMS distance, on the character, between seen markers and the face as solved.
    feature_points : (F, M, 3) float64 [m]
        Markers mapped to the character; occluded ones as the rig predicts them.
    rest : (M, 3) float64 [m]
        Where they rest on the character: on their vertices, or beside them (`shifts`).
    markers : tuple of str, length M
        The markers that were used.
    neutral : (M, D) float64
        Where they rest, in take space.
    noise : float [m]
        Estimated standard deviation of a coordinate of the typical marker, on the character.
    misfit : float [m]
        Difference of face and rig: estimated RMS error of a coordinate of the typical marker beyond
        the noise, in an expressive frame.
    rounds : int
        Rounds of the pose and occlusion loop.
    choice : MapChoice
        The space map, and how well it predicts left-out markers.
    distances : (F, M) float64 [m]
        Between a marker and the face as solved, on the character; NaN where occluded.
    shifts : (M, 3) float64 [m]
        From the vertices that the markers are bound to, to where they sit on the character.
    model : BlendShapeEvaluator
        Of the markers' displacements, N = 3 M, as solved with.
    marker_maps : (M, D, 3) float64
        The linear maps that carry the markers' displacements over to the character.
    head : {"solve", "markers", "stabilised"}
        Source of the pose: head markers of the shot that lie in a line determine none.
    neutral_weights : mapping of str to float
        Blend shape weights that the neutral frames show, which `neutral` is without.
    covariance : (S, S) float64 or None
        Of the weights in a frame [1], as learned from the take; None if it was not.
    errors : (M,) float64 [1] or None
        Of the markers, by those around them; None = alike.
    filmed : FilmedHead or None
        The head before the one camera of a 2D take; None where it was not found in space.
    """

    weights: WeightsTake
    pose: Pose
    residual: FloatArray
    feature_points: FloatArray
    rest: FloatArray
    markers: tuple[str, ...]
    neutral: FloatArray
    noise: float
    misfit: float
    rounds: int
    choice: MapChoice
    distances: FloatArray
    shifts: FloatArray
    model: BlendShapeEvaluator
    marker_maps: FloatArray
    head: HeadMode
    neutral_weights: Mapping[str, float]
    covariance: FloatArray | None
    errors: FloatArray | None
    filmed: FilmedHead | None = None

    def __post_init__(self) -> None:
        freeze(self, "residual", "distances", "feature_points", "rest", "neutral")

    @property
    def dimension(self) -> int:
        """3 of markers in space, 2 of markers in an image."""
        return int(self.neutral.shape[1])

    @property
    def posed_in_space(self) -> bool:
        """Whether `pose` is in metres, of a head in space."""
        return self.dimension == 3 or self.filmed is not None

    @property
    def motion_model(self) -> MotionModel:
        """The unknowns that moved the markers: blend shapes, and the head where it was solved."""
        return MotionModel(self.rest, self.model, self.dimension, self.head == "solve")

    def still(self, take: MarkerTake) -> FloatArray:
        """Return the solved markers of a take out of the head's motion: (F, M, 3)."""
        if self.filmed is not None:
            return on_plane(self.filmed.still(take).select(self.markers))
        return self.pose.to_head(on_plane(take.select(self.markers)))

    @property
    def displacements(self) -> FloatArray:
        """Displacements of the markers on the character from rest: (F, M, 3) [m]."""
        return np.asarray(self.feature_points - self.rest)

    def displaced(self, frames: slice) -> FloatArray:
        """Return the `displacements` of some frames."""
        return np.asarray(self.feature_points[frames] - self.rest)

    def leftover(self, frames: slice) -> FloatArray:
        """Return the residual of the displacements by the solved weights: (F, M, 3) [m]."""
        moved = self.displaced(frames)
        return np.asarray(
            moved - self.model.displacements(self.weights.weights[frames]).reshape(moved.shape)
        )
