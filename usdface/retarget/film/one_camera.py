"""A perspective camera: projection of points, and the pose of a head in its images.

Camera space: metres, x right, y up, the camera at the origin, looking along -z. Images: pixels,
x right, y up, as in 2D takes.

Source: Hartley and Zisserman 2004, Multiple View Geometry in Computer Vision, 6.1 (the pinhole
camera) and appendix 6 (Gauss-Newton on the reprojection error).
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray, freeze
from usdface.errors import SolveError
from usdface.geometry.marker_spread import fit_scale_and_translation
from usdface.geometry.rigid_fit import Pose
from usdface.takes import visible

__all__ = ["PinholeCamera", "fit_pose", "pose_columns", "start_pose"]

# Markers that determine a pose in a frame, with one to spare. Steps of a fit, which converges in
# four to six from a face that looks at the camera; and the least step, of an angle [rad] and of the
# distance, at which it ends.
_FEWEST = 4
_STEPS = 20
_SETTLED = 1e-9
# Keeps a step finite where markers are in a line; of the mean diagonal of the normal matrix.
_DAMPING = 1e-9
# Points are kept this far in front of the camera, of a face's distance.
_NEAREST = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class PinholeCamera:
    """A camera without distortion, with square pixels, in the axes of USD: y up, looking along -z.

    `usdface.geometry.camera.Camera` has those of OpenCV, and lens distortion.

    Attributes
    ----------
    focal_length : float [px]
    centre : (2,) float64 [px]
        Where the optical axis meets the image.
    """

    focal_length: float
    centre: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "centre")

    def image(self, points: FloatArray) -> FloatArray:
        """Return the image (..., 2) [px] of points (..., 3) [m] in camera space."""
        shown = self.focal_length * points[..., :2] / -points[..., 2:] + self.centre
        return np.asarray(shown)

    def slopes(self, points: FloatArray) -> FloatArray:
        """Return the derivative of `image` by the points: (..., 2, 3) [px/m]."""
        depth = -points[..., 2]
        slopes = np.zeros((*points.shape[:-1], 2, 3))
        slopes[..., 0, 0] = slopes[..., 1, 1] = self.focal_length / depth
        slopes[..., 2] = self.focal_length * points[..., :2] / depth[..., None] ** 2
        return slopes

    def rays(self, image: FloatArray) -> FloatArray:
        """Return the directions (..., 3) in which the camera sees places (..., 2) [px]."""
        across = (image - self.centre) / self.focal_length
        return np.concatenate([across, np.full((*image.shape[:-1], 1), -1.0)], axis=-1)

    def at_depths(self, image: FloatArray, pose: Pose, depths: FloatArray) -> FloatArray:
        """Return where rays meet planes of the head: (F, M, 3) [m], in head space.

        Parameters
        ----------
        image : (F, M, 2) float64 [px]
        pose : Pose
            Of the head in camera space.
        depths : (F, M) or (M,) float64 [m]
            Third coordinates in head space.
        """
        ways = self.rays(image) @ pose.rotations
        start = -np.einsum("fj,fji->fi", pose.translations, pose.rotations)[:, None]
        along = (depths - start[..., 2]) / ways[..., 2]
        return np.asarray(start + along[..., None] * ways)


def start_pose(points: FloatArray, image: FloatArray, camera: PinholeCamera) -> Pose:
    """Return the pose of a frontal face, by its position and size in the image.

    Parameters
    ----------
    points : (M, 3) float64 [m]
        In head space.
    image : (F, M, 2) float64 [px]
        NaN where occluded; at least two are visible in each frame.
    camera : PinholeCamera
    """
    size, centre, middle = fit_scale_and_translation(points[:, :2], image)  # px per metre, px, m
    distance = camera.focal_length / size
    place = np.concatenate([(centre - camera.centre) / size[:, None], -distance[:, None]], axis=1)
    middle = np.concatenate([middle, np.full((len(image), 1), points[:, 2].mean())], axis=1)
    return Pose(np.tile(np.eye(3), (len(image), 1, 1)), place - middle)


def fit_pose(
    points: FloatArray,
    image: FloatArray,
    camera: PinholeCamera,
    start: Pose,
    certainty: FloatArray | None = None,
) -> Pose:
    """Fit the pose of a head in every frame, by least squares on the image.

    Parameters
    ----------
    points : (M, 3) or (F, M, 3) float64 [m]
        In head space.
    image : (F, M, 2) float64 [px]
        NaN where occluded.
    camera : PinholeCamera
    start : Pose
        A first guess.
    certainty : (F, M) float64, optional
        One over the deviation of each place, in any unit; all alike, if left out.

    Returns
    -------
    Pose
        Of the head in camera space. Frames with fewer than four markers keep that of the nearest
        frame that has them.

    Raises
    ------
    SolveError
        If no frame has four visible markers.
    """
    points = np.broadcast_to(points, (*image.shape[:2], 3))
    is_visible = visible(image)
    usable = np.asarray(is_visible.sum(axis=1) >= _FEWEST)
    if not usable.any():
        raise SolveError(
            f"no frame shows {_FEWEST} bound markers at once; the head pose is unknown"
        )
    rotations, translations = start.rotations.copy(), start.translations.copy()
    near = _NEAREST * float(np.median(translations[:, 2]))
    known = is_visible[..., None] if certainty is None else (is_visible * certainty)[..., None]
    for _ in range(_STEPS):
        pose = Pose(rotations, translations)
        columns = pose_columns(points, pose, camera) * known[..., None]
        error = image - camera.image(pose.to_take(points))
        left = np.where(is_visible[..., None], error, 0.0) * known
        columns = columns.reshape(len(image), -1, 6)
        normal = columns.transpose(0, 2, 1) @ columns
        normal += _DAMPING * np.trace(normal, axis1=1, axis2=2)[:, None, None] / 6 * np.eye(6)
        normal[~usable] = np.eye(6)
        right = np.einsum("fki,fk->fi", columns, left.reshape(len(image), -1))
        step = np.linalg.solve(normal, right[..., None])[..., 0] * usable[:, None]
        rotations = Rotation.from_rotvec(step[:, :3]).as_matrix() @ rotations
        translations = translations + step[:, 3:]
        translations[:, 2] = np.minimum(translations[:, 2], near)
        if np.abs(step).max(initial=0.0) < _SETTLED:
            break
    return Pose(rotations, translations).bridged(usable)


def pose_columns(points: FloatArray, pose: Pose, camera: PinholeCamera) -> FloatArray:
    """Return the image's derivative by three rotations and translations: (F, M, 2, 6).

    Rotations [px/rad] are about the head's origin, along the axes of camera space.
    """
    turned = points @ pose.rotations.transpose(0, 2, 1)
    slopes = camera.slopes(turned + pose.translations[:, None])
    about = np.cross(np.eye(3), turned[..., None, :]).swapaxes(-1, -2)  # a column for each axis
    return np.concatenate([slopes @ about, slopes], axis=-1)
