"""The head in a take of one camera: its pose in space, and its markers without head motion.

The camera shows the centre of the part of a painted dot that faces it; a marker is the mean of the
skin under the dot.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake, visible

__all__ = ["FilmedHead", "certainty"]

# A dot that is seen this obliquely (cosine) is as uncertain as any; below, circles are specks.
_LEAST_FACING = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class FilmedHead:
    """The motion of a head before the camera.

    Attributes
    ----------
    markers : tuple of str, length M
    camera : PinholeCamera
    pose : Pose
        Of the head in camera space. Head space is that of the character at rest.
    rest : (M, 3) float64 [m]
        The resting markers, in head space.
    moved : (F, M, 3) float64 [m]
        Displacements by the weights, in head space.
    rest_pose : Pose
        Of one frame, the neutral.
    beside : (F, M, 2) float64 [px]
        From the mean of the skin under each dot to the dot's centre in the image.
    facing : (F, M) float64
        Foreshortening of each dot's area in the image.
    errors : (M,) float64 [1]
        Of the markers (`usdface.retarget.film.filmed_errors`).
    mapped : bool
        Displacements go through the space map; else they are taken as they are.
    """

    markers: tuple[str, ...]
    camera: PinholeCamera
    pose: Pose
    rest: FloatArray
    moved: FloatArray
    rest_pose: Pose
    beside: FloatArray
    facing: FloatArray
    errors: FloatArray
    mapped: bool

    @property
    def motion(self) -> Pose:
        """The motion of the head from its pose in the neutral frames, in head space."""
        turn, shift = self.rest_pose.rotations[0], self.rest_pose.translations[0]
        return Pose(turn.T @ self.pose.rotations, (self.pose.translations - shift) @ turn)

    @property
    def metre(self) -> float:
        """Scale of the face in the image [px/m], the median over the take."""
        return self.camera.focal_length / -float(np.median(self.pose.to_take(self.rest)[..., 2]))

    def in_neutral_image(self, moved: FloatArray) -> FloatArray:
        """Return displacements (M, 3) [m] from rest in the neutral image: (M, 2) [px]."""
        both = self.rest_pose.to_take(np.stack([self.rest, self.rest + moved])[:, None])
        before, after = (self.camera.image(each)[0] for each in both)
        return np.asarray(after - before)

    def still(self, take: MarkerTake) -> MarkerTake:
        """Return a take as a frontal orthographic view of a head that does not move: (F, M, 2) [m].

        Markers that are not bound are carried along at the face's mean depth.
        """
        own = self._columns(take)
        depths = np.full((len(take.times), len(take.names)), self.rest[:, 2].mean())
        depths[:, own] = self.rest[:, 2] + self.moved[..., 2]
        image = take.positions.copy()
        image[:, own] -= self.beside
        flat = self.camera.at_depths(image, self.pose, depths)[..., :2]
        return self._in_head_space(take, flat)

    def projected(self, take: MarkerTake) -> tuple[MarkerTake, Views]:
        """Return a take as projected by the camera, (F, M, 2) [m], and its views.

        Its markers are at their neutral positions plus their displacements in the image. Markers
        that are not bound are as in `still`.
        """
        own = self._columns(take)
        placed = self.pose.to_take(self.rest + self.moved)
        slopes = self.camera.slopes(placed) @ self.pose.rotations[:, None] / self.metre
        left = take.positions[:, own] - self.beside - self.camera.image(placed)
        projected = (slopes @ self.moved[..., None])[..., 0] + left / self.metre
        result = self.still(take)
        positions = result.positions.copy()
        positions[:, own] = self.rest[:, :2] + projected
        sure = certainty(self.facing, visible(left), self.errors)
        views = Views(self.markers, slopes, sure, self.mapped)
        return replace(result, positions=positions), views

    def _columns(self, take: MarkerTake) -> list[int]:
        return [take.names.index(name) for name in self.markers]

    def _in_head_space(self, take: MarkerTake, flat: FloatArray) -> MarkerTake:
        return replace(
            take,
            positions=flat,
            image_size=None,
            focal_length=0.0,
            diameters=None if take.diameters is None else take.diameters / self.metre,
            deviation=take.deviation / self.metre,
        )


def certainty(facing: FloatArray, is_visible: BoolArray, errors: FloatArray) -> FloatArray:
    """Return the deviation of a take over that of its samples, by the errors of markers: (F, M).

    The deviation of a dot's place goes as one over its cosine: of six films before a phone it is
    0.12, 0.14, 0.20, 0.29 and 0.52 px at cosines of 0.95, 0.8, 0.6, 0.43 and 0.28.

    Parameters
    ----------
    facing, errors : (F, M), (M,) float64
        As of `FilmedHead`.
    is_visible : (F, M) bool
    """
    cosine = facing.clip(_LEAST_FACING, 1.0)
    usual = np.sqrt(np.mean(cosine[is_visible] ** -2.0)) if is_visible.any() else 1.0
    return np.asarray(cosine * usual / errors)
