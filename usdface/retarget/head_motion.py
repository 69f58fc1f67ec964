"""The performer's head motion on the character: scaled to its size, smooth over the take."""

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded
from scipy.spatial.transform import Rotation

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose, similarity_fit
from usdface.geometry.rigid_modes import small_motions
from usdface.numerics.visibility_patterns import visibility_patterns
from usdface.retarget.solver.curvature import curvature_bands
from usdface.takes import frame_step

__all__ = ["head_motion", "smooth_motion", "turned_at_neutral"]

# Beyond this angle [rad] rotation vectors cannot be averaged: they wrap around at pi. Of a whole
# turn a fifth of the frames are beyond it; half of that are single wrong poses.
_FAR = 2.5
_FEW = 0.1
# A mean turn of the head [degrees] from neutral that is reported: about twice the largest in the
# real optical takes, 5.7. Set by hand.
_TURNED = 10.0
# Ratios of the variance of the noise to that of the second difference that are tried: two per
# decade, from a head that shakes to one that rests.
_WEIGHTS = np.logspace(-4, 8, 25)
# The least noise [m] assumed where gaps are bridged: a thousandth of the jitter of optical markers.
_FINEST = 1e-7


def head_motion(
    pose: Pose,
    times: FloatArray,
    neutral: FloatArray,
    target: FloatArray,
    noise: float,
    seen: BoolArray,
) -> Pose:
    """Return the motion of the character's head from its neutral position.

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
    seen : (F, M) bool
        Markers that the pose was fitted to.

    Returns
    -------
    Pose
        In the character's space, for points of the character at rest.
    """
    linear, offset = similarity_fit(neutral, target)
    # A point c = x L + o of the character moves to (x R' + t) L + o.
    turned = np.linalg.inv(linear) @ pose.rotations.transpose(0, 2, 1) @ linear
    moved = pose.translations @ linear + offset - offset @ turned
    return smooth_motion(Pose(turned.transpose(0, 2, 1), moved), times, target, noise, seen)


def turned_at_neutral(motion: Pose, source: str) -> list[Finding]:
    """Report a head that is turned in the neutral frames against its usual direction.

    The character's head looks straight ahead there, and to the other side in most of the take.

    Parameters
    ----------
    motion : Pose
        Of the character's head from its neutral position.
    source : str
        Of the take.
    """
    # SciPy before 1.15.1 wants to write
    angle = np.degrees(Rotation.from_matrix(motion.rotations.copy()).mean().magnitude())
    if angle < _TURNED:
        return []
    message = (
        "on average the head is turned by {turn_degrees:.0f} degrees from the neutral frames, in "
        "which the character looks straight ahead"
    )
    return [finding("HEAD_TURNED_AT_NEUTRAL", source, message, float(angle))]


def smooth_motion(
    pose: Pose, times: FloatArray, points: FloatArray, noise: float, seen: BoolArray
) -> Pose:
    """Smooth the noise of the markers out of a pose, and bridge frames that showed too few.

    Each of the three angles and three coordinates of the face's centre is the most probable
    curve if its second derivative is white; its power is the one that makes the take itself
    most probable (Whittaker 1923, the weight by marginal likelihood). A frame is weighted by how
    well its visible markers determine the pose; with fewer than three it does not count. Nor does
    a frame beyond 2.5 rad, which keeps its pose; a head that turns around keeps all of them.
    Before the first frame that counts and after the last one the head is held: the curve would go
    on as a straight line, and turn a head that leaves the picture about itself.

    Parameters
    ----------
    pose : Pose
    times : (F,) float64 [s]
    points : (M, 3) float64 [m]
        The markers, before the pose.
    noise : float [m]
        Standard deviation of a coordinate; 0 changes nothing where markers show the pose.
    seen : (F, M) bool
        Markers that are visible in each frame.
    """
    rotations = Rotation.from_matrix(pose.rotations.copy())  # SciPy before 1.15.1 wants to write
    angles, centre = rotations.as_rotvec(), points.mean(axis=0)
    shown = seen.sum(axis=1) >= POSE_MARKERS
    far = np.linalg.norm(angles, axis=1) > _FAR
    known = shown & ~far
    if len(times) < 3 or not known.any() or (far & shown).mean() > _FEW:
        return pose
    if noise <= 0.0 and shown.all():
        return pose
    places = pose.translations + rotations.apply(centre)
    variances = max(noise, _FINEST) ** 2 * _uncertainties(points, seen)
    precisions = np.where(known[:, None], 1.0 / variances, 0.0)
    curves = np.concatenate([places, angles], axis=1)
    smooth = np.stack(
        [_smooth(c, times, p) for c, p in zip(curves.T, precisions.T, strict=True)], axis=1
    )
    counted = np.flatnonzero(known)
    smooth = smooth[np.arange(len(times)).clip(counted[0], counted[-1])]
    turned = Rotation.from_rotvec(smooth[:, 3:])
    own = far & shown
    return Pose(
        np.where(own[:, None, None], pose.rotations, turned.as_matrix()),
        np.where(own[:, None], pose.translations, smooth[:, :3] - turned.apply(centre)),
    )


def _uncertainties(points: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the variances of the three coordinates and angles for unit noise: (F, 6)."""
    motions = small_motions(points, False).transpose(1, 0, 2)
    each = (motions @ motions.transpose(0, 2, 1)).reshape(len(points), 36)
    patterns, which = visibility_patterns(seen)
    whole = (patterns @ each).reshape(-1, 6, 6)
    # Markers in a line leave a turn about it open: a tiny prior, of angles and of metres.
    whole += 1e-6 * each.sum(axis=0).reshape(6, 6).diagonal() * np.eye(6)
    inverse = np.diagonal(np.linalg.inv(whole), axis1=1, axis2=2)
    return np.asarray(inverse[which], np.float64)


def _smooth(curve: FloatArray, times: FloatArray, precisions: FloatArray) -> FloatArray:
    """Return the most probable curve (F,) of a measured one; a precision of 0 = not measured.

    `curve` (F,) is in metres or radians, `precisions` (F,) in 1 / m^2 or 1 / rad^2.
    """
    bands = curvature_bands(times) * frame_step(times) ** 3
    unit = float(precisions.max())
    trust = precisions / unit
    count = int((trust > 0.0).sum())
    if count < 3:
        return np.interp(times, times[trust > 0.0], curve[trust > 0.0])
    best, answer = np.inf, curve
    for weight in _WEIGHTS:
        system = weight * bands
        system[2] += trust
        try:
            factor = cholesky_banded(system, overwrite_ab=True, check_finite=False)
        except LinAlgError:  # too weak a curve over too long a gap
            continue
        smooth = cho_solve_banded((factor, False), trust * curve, check_finite=False)
        # Twice the negative log likelihood; straight lines are free.
        misfit = (trust * curve) @ (curve - smooth) * unit
        volume = 2.0 * np.log(factor[2]).sum() - (len(curve) - 2) * np.log(weight)
        if misfit + volume < best:
            best, answer = misfit + volume, smooth
    return np.asarray(answer)
