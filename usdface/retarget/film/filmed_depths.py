"""Depths of the markers from one camera, by parallax as the head turns."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera, pose_columns
from usdface.takes import visible

__all__ = ["refined_depths"]

# Largest correlation of residuals from frame to frame: at most 200 frames count as one.
_MOST_ALIKE = 0.99
# Standard deviation of a marker's depth between two people, of the face's size: 4 mm, as between
# the faces of the ICT model (identity modes).
_DEPTH_SPREAD = 0.08
# Least deviation of the residual, of the face's size. A pose that absorbs some of an expression
# turns a head that rests; with a very small residual these turns would be taken for parallax. By
# 0.003, 0.01 and 0.03 a filmed head at rest (10 s by a phone, the recorded curves from 100 s on)
# has weights that are off by 0.108, 0.095 and 0.095, without it by 0.110.
_MISFIT = 0.01


def refined_depths(
    film: FilmedTake,
    camera: PinholeCamera,
    look: Pose,
    pose: Pose,
    rest: FloatArray,
    moved: FloatArray,
    sure: FloatArray,
) -> FloatArray:
    """Return the neutral markers' depths (M,) [m], refined by the parallax of a turning head.

    A marker that is deeper than assumed lies on the same ray in the neutral frames, but off its
    prediction once the head turns. One step of least squares, with the character's depths as a
    prior. Poses are free, weights are free within a ridge, and positions across the rays within the
    noise of the neutral frames: motion that an expression explains is not evidence of depth.

    Parameters
    ----------
    film : FilmedTake
    camera : PinholeCamera
    look, pose : Pose
        Of the neutral, one frame, and of all frames.
    rest : (M, 3) float64 [m]
        The markers where they rest.
    moved : (F, M, 3) float64 [m]
        How far weights move them.
    sure : (F, M) float64
        As of `usdface.retarget.film.filmed_head.certainty`.
    """
    known = (visible(film.image) * sure)[..., None]
    placed = pose.to_take(rest + moved)
    left = np.where(known > 0.0, film.image - camera.image(placed), 0.0) * known
    slopes = camera.slopes(placed) @ pose.rotations[:, None] * known[..., None]
    # The residual is correlated in time, so there are fewer independent frames.
    alike = float((left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300))
    lasting = (1.0 + alike) / (1.0 - min(alike, _MOST_ALIKE))
    scale = camera.focal_length / -float(np.median(pose.translations[:, 2]))
    size = rms_radius(film.face)
    frame_variance = max(_mean_square(left, known), (_MISFIT * size * scale) ** 2)
    variance = lasting * frame_variance
    poses = pose_columns(rest + moved, pose, camera) * known[..., None]
    taken = _explained(poses, slopes @ film.skin.offsets.transpose(1, 2, 0), frame_variance)
    columns = slopes @ _error_directions(film, camera, look).transpose(0, 2, 1)  # (F, M, 2, 3)
    normal, right = _without(taken, columns, left)
    prior = variance / (_DEPTH_SPREAD * size) ** 2
    right[2::3] -= prior * (rest[:, 2] - film.face[:, 2])
    both = (known[1:] > 0.0) & (known[:-1] > 0.0)
    # Noise of a frame: the part of the residual that is not correlated in time.
    noise = _mean_square(np.where(both, np.diff(left, axis=0), 0.0), both) / 2.0
    first, last = film.neutral
    across = scale**2 * (last - first + 1) * variance / max(noise, 1e-12 * variance)
    normal += np.diag(np.tile([across, across, prior], len(rest)))
    return np.asarray(rest[:, 2] + np.linalg.solve(normal, right)[2::3])


def _error_directions(film: FilmedTake, camera: PinholeCamera, look: Pose) -> FloatArray:
    """Return the directions of the markers' errors: across, and along their rays (M, 3, 3)."""
    directions = np.tile(np.eye(3), (len(film.face), 1, 1))
    directions[:, 2] = camera.rays(film.rest) @ look.rotations[0]
    directions[:, 2] /= directions[:, 2, 2:]
    return directions


def _explained(poses: FloatArray, shapes: FloatArray, variance: float) -> FloatArray:
    """Return T: T T' maps residuals to the part that poses and weights of about 1 explain.

    Priors: deviations of a radian or a metre for a pose, and of 1 for a weight.

    Parameters
    ----------
    poses : (F, M, 2, 6) float64 [px]
    shapes : (F, M, 2, S) float64 [px]
    variance : float [px^2]
        Of a coordinate in a frame.

    Returns
    -------
    (F, M, 2, 6 + S) float64
    """
    both = np.concatenate([poses, shapes], axis=-1)
    flat = both.reshape(len(both), -1, both.shape[-1])
    normal = flat.transpose(0, 2, 1) @ flat
    half = np.linalg.cholesky(normal + variance * np.eye(both.shape[-1]))
    taken = np.linalg.solve(half, flat.transpose(0, 2, 1)).transpose(0, 2, 1)
    return np.asarray(taken.reshape(both.shape))


def _without(
    taken: FloatArray, columns: FloatArray, left: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return normal matrix and right-hand side of columns (F, M, 2, 3), each marker's own."""
    shared = np.einsum("fmki,fmkj->fimj", taken, columns, optimize=True)
    shared = shared.reshape(len(left), taken.shape[-1], -1)
    normal = -np.tensordot(shared, shared, ((0, 1), (0, 1)))
    for k, block in enumerate(np.einsum("fmki,fmkj->mij", columns, columns)):
        normal[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += block
    explained = np.einsum("fmki,fmk->fi", taken, left, optimize=True)
    right = np.einsum("fmki,fmk->mi", columns, left).ravel()
    return normal, right - np.einsum("fik,fi->k", shared, explained)


def _mean_square(values: FloatArray, is_visible: FloatArray | BoolArray) -> float:
    """Return the mean square of the visible (F, M, 1) coordinates (F, M, 2)."""
    return float((values**2).sum() / (2 * max((is_visible > 0.0).sum(), 1)))
