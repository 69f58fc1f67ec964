"""How deep a face is by the image of one camera: what turns with the head, but not as thought."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.filmed_take import FilmedTake
from usdface.retarget.one_camera import PinholeCamera, pose_columns
from usdface.takes import visible

__all__ = ["refined_depths"]

# Of what is left from frame to frame: at most 200 frames count as one.
_MOST_ALIKE = 0.99
# Standard deviation of a marker's depth between two people, of the face's size: 4 mm, as between
# the faces of the ICT model (identity modes).
_DEPTH_SPREAD = 0.08
# Least deviation of what poses and weights leave, of the face's size. What the pose takes of an
# expression turns a head that rests; where hardly anything is left of the image these turns would
# tell depths. By 0.003, 0.01 and 0.03 a filmed head at rest (10 s by a phone, the recorded curves
# from 100 s on) has weights that are off by 0.108, 0.095 and 0.095, without it by 0.110.
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
    """Return the resting markers' depths (M,) [m] that a turning head makes more likely.

    A marker that is deeper than thought lies on the same ray in the neutral frames, and off its
    place as soon as the head turns. One step of least squares from the character's depths as a
    prior, in which all poses are free, and so are the markers' places across, as far as the neutral
    frames are noisy.

    Parameters
    ----------
    moved : (F, M, 3) float64 [m]
        How far weights move the markers.
    sure : (F, M) float64
        As of `certainty`.
    """
    known = (visible(film.image) * sure)[..., None]
    placed = pose.to_take(rest + moved)
    left = np.where(known > 0.0, film.image - camera.image(placed), 0.0) * known
    slopes = camera.slopes(placed) * known[..., None]
    turning = slopes @ pose.rotations[:, None]
    # What poses and weights leave lasts from frame to frame: fewer frames than there are tell.
    alike = float((left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300))
    lasting = (1.0 + alike) / (1.0 - min(alike, _MOST_ALIKE))
    scale = camera.focal_length / -float(np.median(pose.translations[:, 2]))
    least = (_MISFIT * rms_radius(film.face) * scale) ** 2
    square = float((left**2).sum() / (2 * max((known > 0.0).sum(), 1)))
    variance = lasting * max(square, least)
    poses = pose_columns(rest + moved, pose, camera) * known[..., None]
    turns = np.linalg.qr(poses.reshape(len(left), -1, 6))[0].reshape(poses.shape)
    ways = np.tile(np.eye(3), (len(rest), 1, 1))
    ways[:, 2] = camera.rays(film.rest) @ look.rotations[0]
    ways[:, 2] /= ways[:, 2, 2:]
    columns = turning @ ways.transpose(0, 2, 1)  # (F, M, 2, 3)
    shared = np.einsum("fmki,fmkj->fimj", turns, columns).reshape(len(left), 6, -1)
    normal = -np.tensordot(shared, shared, ((0, 1), (0, 1)))
    own = np.einsum("fmki,fmkj->mij", columns, columns)
    for k, block in enumerate(own):
        normal[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += block
    posed = np.einsum("fmki,fmk->fi", turns, left)
    right = np.einsum("fmki,fmk->mi", columns, left).ravel() - np.einsum("fik,fi->k", shared, posed)
    prior = variance / (_DEPTH_SPREAD * rms_radius(film.face)) ** 2
    right[2::3] -= prior * (rest[:, 2] - film.face[:, 2])
    both = (known[1:] > 0.0) & (known[:-1] > 0.0)
    changes = np.where(both, left[1:] - left[:-1], 0.0)
    noise = float((changes**2).sum() / (4 * max(both.sum(), 1)))  # of a frame: what does not last
    first, last = film.neutral
    across = scale**2 * (last - first + 1) * variance / max(noise, 1e-12 * variance)
    normal += np.diag(np.tile([across, across, prior], len(rest)))
    step = np.linalg.solve(normal, right)
    return np.asarray(rest[:, 2] + step[2::3])
