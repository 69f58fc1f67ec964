"""Markers of a film without head motion, before a neutral is known, by the rig they are bound to.

Poses before the camera, weights and the performer's face are solved alternately, as in
`usdface.retarget.film.solve_film`; here weights have no bounds, since any pose may be the neutral.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.binding.registration import MOTION_ERROR
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_depths import DEPTH_SPREAD
from usdface.retarget.film.focal_length import usual_camera
from usdface.retarget.film.one_camera import PinholeCamera, fit_pose, pose_columns, start_pose
from usdface.takes import MarkerTake, visible

__all__ = ["stabilised_film"]

# Alternations: of 72 rests 64 are found with 4, 63 with 5 and 65 with 8.
_ROUNDS = 5
# Prior deviation of the weights is about 0.4, as in `usdface.binding.peak_motion`.
_WEIGHT_PRIOR = 0.2
# A frame whose RMS residual is so many times the take's median, and so many expected errors, is a
# false detection: it shows no face.
_ASTRAY = 5.0
# Frames whose weights are solved at once: a bound on memory.
_BLOCK = 256


def stabilised_film(take: MarkerTake, points: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the markers of a take of an image without head motion: (F, M, 3) [m], in head space.

    NaN where occluded, and in frames of false detections, which the shapes are far from explaining.
    Each is at the depth of its point: an image shows no motion along the view.

    Parameters
    ----------
    take : MarkerTake
        Of an image, with M markers; each of them is seen at least once.
    points : (M, 3) float64 [m]
        Where they rest on the character.
    offsets : (S, M, 3) float64 [m]
        Blend shapes there.

    Raises
    ------
    SolveError
        If no frame shows four markers.
    """
    image, middle = take.positions, np.nanmedian(take.positions, axis=0)
    camera, count = usual_camera(take, middle), len(image)
    look = start_pose(points, middle[None], camera)
    pose = Pose(np.repeat(look.rotations, count, 0), np.repeat(look.translations, count, 0))
    error = MOTION_ERROR * rms_radius(points)
    face, weights = points, np.zeros((count, len(offsets)))
    for _ in range(_ROUNDS):
        placed = face + np.tensordot(weights, offsets, 1)
        pose = fit_pose(placed, image, camera, pose)
        left, slopes, turns = _seen(image, camera, pose, placed, error)
        step = _face_step(left, slopes, face - points)
        face = face + step
        left -= (slopes @ step[..., None])[..., 0]
        weights = weights + _weight_steps(left, slopes, turns, offsets, weights, error**2)
    placed = face + np.tensordot(weights, offsets, 1)
    pose = fit_pose(placed, image, camera, pose)
    still = camera.at_depths(image, pose, placed[..., 2])
    still[..., 2] = points[:, 2]
    known, _ = _residual(image, camera, pose, placed, error)
    return np.where(known[..., None], still, np.nan)


def _residual(
    image: FloatArray, camera: PinholeCamera, pose: Pose, placed: FloatArray, error: float
) -> tuple[BoolArray, FloatArray]:
    """Return where markers are seen (F, M), and their residual in the image (F, M, 2) [m].

    Those of a frame that is a false detection are not; residuals are 0 where occluded. `error` [m]
    is expected of a marker, the others are as in `_seen`.
    """
    known = visible(image)
    before = pose.to_take(placed)
    metre = camera.focal_length / -float(np.median(before[..., 2]))  # px
    left = np.where(known[..., None], image - camera.image(before), 0.0) / metre
    size = np.sqrt((left**2).sum(axis=(1, 2)) / np.maximum(known.sum(axis=1), 1))
    usual = max(float(np.median(size[known.any(axis=1)])), error)
    known &= (size <= _ASTRAY * usual)[:, None]
    return known, np.where(known[..., None], left, 0.0)


def _seen(
    image: FloatArray, camera: PinholeCamera, pose: Pose, placed: FloatArray, error: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the residual in the image and its derivatives by places and poses; 0 where occluded.

    Parameters
    ----------
    image : (F, M, 2) float64 [px]
    camera : PinholeCamera
    pose : Pose
        Of the head in camera space.
    placed : (F, M, 3) float64 [m]
        In head space.
    error : float [m]
        Expected of a marker.

    Returns
    -------
    left : (F, M, 2) float64 [m]
        At the face's median distance.
    slopes : (F, M, 2, 3) float64
        Derivative of the image by positions in head space.
    turns : (F, M, 2, 6) float64
        Derivative by the pose, in any unit.
    """
    known, left = _residual(image, camera, pose, placed, error)
    before = pose.to_take(placed)
    metre = camera.focal_length / -float(np.median(before[..., 2]))  # px
    slopes = camera.slopes(before) @ pose.rotations[:, None] / metre
    turns = pose_columns(placed, pose, camera)
    seen = known[..., None, None]
    return left, np.where(seen, slopes, 0.0), np.where(seen, turns, 0.0)


def _face_step(left: FloatArray, slopes: FloatArray, away: FloatArray) -> FloatArray:
    """Return the change of the markers' rest (M, 3) [m] that leaves least over the whole take.

    The prior is the difference of two people's faces: `away` (M, 3) [m] so far.
    """
    prior = (MOTION_ERROR / DEPTH_SPREAD) ** 2
    normal = np.einsum("fmki,fmkj->mij", slopes, slopes) + prior * np.eye(3)
    right = np.einsum("fmki,fmk->mi", slopes, left) - prior * away
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])


def _weight_steps(
    left: FloatArray,
    slopes: FloatArray,
    turns: FloatArray,
    offsets: FloatArray,
    weights: FloatArray,
    variance: float,
) -> FloatArray:
    """Return the change of the weights (F, S) that leaves least, the pose of each frame free.

    The ridge is about their mean: the performer's face is free, so no weight is known to be 0.
    """
    ridge = _WEIGHT_PRIOR * left.shape[1] * variance
    pull = ridge * (weights - weights.mean(axis=0))
    steps = np.empty_like(weights)
    for first in range(0, len(left), _BLOCK):
        own = slice(first, first + _BLOCK)
        shapes = np.einsum("fmki,smi->fsmk", slopes[own], offsets, optimize=True)
        shapes = shapes.reshape(len(shapes), len(offsets), 2 * left.shape[1])
        rigid = np.linalg.qr(turns[own].reshape(len(shapes), -1, turns.shape[-1]))[0]
        free = shapes - (shapes @ rigid) @ rigid.transpose(0, 2, 1)
        normal = free @ free.transpose(0, 2, 1) + ridge * np.eye(len(offsets))
        right = (free @ left[own].reshape(len(shapes), -1, 1))[..., 0] - pull[own]
        steps[own] = np.linalg.solve(normal, right[..., None])[..., 0]
    return steps
