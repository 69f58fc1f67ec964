"""The performer's head motion as the character's: carried over in size, smooth over the take."""

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.spatial.transform import Rotation

from usdface.retarget.align import Pose, similarity_fit
from usdface.retarget.joint import small_motions
from usdface.retarget.spacetime import curvature_bands
from usdface.takes import FloatArray

__all__ = ["head_motion", "smooth_motion"]

# Beyond this angle [rad] rotation vectors are no longer a plain space to average in.
_FAR = 2.5
# Variance of the noise over that of a step's second difference: what is tried.
_WEIGHTS = np.logspace(-4, 8, 25)


def head_motion(
    pose: Pose, times: FloatArray, neutral: FloatArray, target: FloatArray, noise: float
) -> Pose:
    """Return how the character's head moves from its place at rest.

    Parameters
    ----------
    pose : Pose
        Of the performer's head, in take space.
    times : (F,) float64 [s]
    neutral : (M, 3) float64 [m]
        Where the markers rest, in take space.
    target : (M, 3) float64 [m]
        Where they sit on the character.
    noise : float [m]
        Standard deviation of a marker coordinate on the character.

    Returns
    -------
    Pose
        In the character's space, for points of the character at rest.
    """
    linear, offset = similarity_fit(neutral, target)
    # A point c = x L + o of the character moves to (x R' + t) L + o.
    turned = np.linalg.inv(linear) @ pose.rotations.transpose(0, 2, 1) @ linear
    moved = pose.translations @ linear + offset - offset @ turned
    return smooth_motion(Pose(turned.transpose(0, 2, 1), moved), times, target, noise)


def smooth_motion(pose: Pose, times: FloatArray, points: FloatArray, noise: float) -> Pose:
    """Take out of a pose what the noise of its markers put in.

    Each of the three angles and three coordinates of the face's centre is the most probable
    curve if its second derivative is white; how strong that is, is what makes the take itself
    most probable (Whittaker 1923, the weight by marginal likelihood).

    Parameters
    ----------
    pose : Pose
    times : (F,) float64 [s]
    points : (M, 3) float64 [m]
        The markers, before the pose.
    noise : float [m]
        Standard deviation of a coordinate; 0 changes nothing.
    """
    rotations = Rotation.from_matrix(pose.rotations)
    angles, centre = rotations.as_rotvec(), points.mean(axis=0)
    if noise <= 0.0 or len(times) < 3 or np.linalg.norm(angles, axis=1).max() > _FAR:
        return pose
    places = pose.translations + rotations.apply(centre)
    motions = small_motions(points, False).reshape(6, -1)
    variances = noise**2 * np.diag(np.linalg.pinv(motions @ motions.T))
    curves = np.concatenate([places, angles], axis=1)
    smooth = np.stack(
        [_smooth(c, times, v) for c, v in zip(curves.T, variances, strict=True)], axis=1
    )
    turned = Rotation.from_rotvec(smooth[:, 3:])
    return Pose(turned.as_matrix(), smooth[:, :3] - turned.apply(centre))


def _smooth(curve: FloatArray, times: FloatArray, variance: float) -> FloatArray:
    bands = curvature_bands(times) * float(np.median(np.diff(times))) ** 3
    best, answer = np.inf, curve
    for weight in _WEIGHTS:
        system = weight * bands
        system[2] += 1.0
        factor = cholesky_banded(system, overwrite_ab=True, check_finite=False)
        smooth = cho_solve_banded((factor, False), curve, check_finite=False)
        # Twice the negative log likelihood; straight lines are free.
        misfit = curve @ (curve - smooth) / variance
        volume = 2.0 * np.log(factor[2]).sum() - (len(curve) - 2) * np.log(weight)
        if misfit + volume < best:
            best, answer = misfit + volume, smooth
    return np.asarray(answer)
