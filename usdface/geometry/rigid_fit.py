"""Rigid and similarity fits between marker sets, for all frames at once."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.errors import SolveError

__all__ = [
    "ALL_AT_ONE_PLACE",
    "IN_LINE",
    "POSE_MARKERS",
    "Pose",
    "mean_scale",
    "rigid_fit",
    "similarity_fit",
]

# Markers that determine a pose, if they are not in a line.
POSE_MARKERS = 3

# Markers are in a line if they deviate from it by at most this share of its length: 1 mm of
# 50, where noise of 0.3 mm would turn the head by 17 degrees.
IN_LINE = 0.02

ALL_AT_ONE_PLACE = (
    "all markers are at the same neutral place; check the neutral frames, and the columns that the "
    "take is read from"
)


@dataclass(frozen=True, eq=False, slots=True)
class Pose:
    """Head pose of every frame: take space = head space @ rotation.T + translation.

    Attributes
    ----------
    rotations : (F, 3, 3) float64
        Column-vector rotation matrices.
    translations : (F, 3) float64 [m]
    """

    rotations: FloatArray
    translations: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "rotations", "translations")

    @classmethod
    def identity(cls, count: int) -> "Pose":
        """Return the pose of a head that does not move, for `count` frames."""
        return cls(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))

    def to_head(self, positions: FloatArray) -> FloatArray:
        """Remove the head motion from positions (F, M, 3)."""
        return np.asarray((positions - self.translations[:, None]) @ self.rotations)

    def to_take(self, positions: FloatArray) -> FloatArray:
        """Apply the head motion to positions (F, M, 3): the inverse of `to_head`."""
        moved = positions @ self.rotations.transpose(0, 2, 1)
        return np.asarray(moved + self.translations[:, None])

    def at(self, frames: IntArray | slice) -> "Pose":
        """Return the pose of some frames: a slice, or indices (N,)."""
        return Pose(self.rotations[frames], self.translations[frames])

    def bridged(self, usable: BoolArray) -> "Pose":
        """Return the pose with that of the nearest `usable` frame (F,) in those that are not.

        Unchanged, if none is.
        """
        if usable.all() or not usable.any():
            return self
        frames = np.arange(len(usable))
        known = frames[usable]
        place = np.searchsorted(known, frames).clip(max=len(known) - 1)
        before = known[np.maximum(place - 1, 0)]
        nearest = np.where(frames - before < known[place] - frames, before, known[place])
        nearest[usable] = known
        return self.at(nearest)


def rigid_fit(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> tuple[Pose, BoolArray]:
    """Fit `target` = pose(`source`) by least squares in every frame (Kabsch; Umeyama 1991).

    Parameters
    ----------
    source : (M, 3) or (F, M, 3) float64
    target : (F, M, 3) float64
        NaN where a marker is occluded.
    weights : (M,) float64, optional
        Of the squared distances, above 0; equal, if left out.

    Returns
    -------
    pose : Pose
        Frames with fewer than three usable markers, or only some in a line, carry on the pose of
        the nearest frame that has them.
    usable : (F,) bool
        True where at least three markers were seen that are not in a line (three of any kind, if
        no frame shows others).

    Raises
    ------
    SolveError
        If no frame has three usable markers.
    """
    source = np.broadcast_to(source, target.shape)
    seen = ~(np.isnan(target[..., 0]) | np.isnan(source[..., 0]))
    usable: BoolArray = np.asarray(seen.sum(axis=1) >= POSE_MARKERS)
    if not usable.any():
        raise SolveError("no frame shows three head markers at once; the head pose is unknown")
    counted = seen if weights is None else seen * weights
    whole = counted.sum(axis=1, keepdims=True)
    weight = (counted / np.where(whole > 0.0, whole, 1.0))[:, None]
    a, b = source, target
    if not seen.all():
        a, b = np.where(seen[..., None], source, 0.0), np.where(seen[..., None], target, 0.0)
    centre_a, centre_b = (weight @ a)[:, 0], (weight @ b)[:, 0]
    # Hidden markers are zero in both, so one centred side is enough.
    b = b - centre_b[:, None]
    if weights is not None or not seen.all():
        b *= counted[..., None]
    rotations, extents = _rotation(b.transpose(0, 2, 1) @ a)
    spread = usable & (extents[:, 1] > IN_LINE**2 * extents[:, 0])
    usable = spread if spread.any() else usable
    translations = centre_b - np.einsum("fij,fj->fi", rotations, centre_a)
    return Pose(rotations, translations).bridged(usable), usable


def _rotation(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rotations (F, 3, 3) closest to the matrices `covariance` (F, 3, 3).

    And their singular values (F, 3), falling: the squared extents of the markers.
    """
    u, extents, vt = np.linalg.svd(covariance)
    flip = np.ones((len(covariance), 3))
    flip[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation: FloatArray = (u * flip[:, None, :]) @ vt
    return rotation, extents


def similarity_fit(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Fit ``target = source @ linear + offset`` with linear = scale * rotation.

    Parameters
    ----------
    source, target : (M, 3) float64
    weights : (M,) float64, optional
        Of the squared distances; equal, if left out.

    Returns
    -------
    linear : (3, 3) float64
    offset : (3,) float64

    Raises
    ------
    SolveError
        If all source points coincide.
    """
    share = np.full(len(source), 1.0) if weights is None else weights
    centre_a, centre_b = (np.average(p, axis=0, weights=share) for p in (source, target))
    a, b = source - centre_a, target - centre_b
    size = float(share @ (a**2).sum(axis=1))
    if size == 0.0:
        raise SolveError(ALL_AT_ONE_PLACE)
    covariance = (b * share[:, None]).T @ a
    rotation = _rotation(covariance[None])[0][0]
    scale = float((rotation * covariance).sum()) / size
    linear = scale * rotation.T
    return linear, centre_b - centre_a @ linear


def mean_scale(linear: FloatArray) -> float:
    """Return the factor of a linear map (3, 3) on lengths: the cube root of that on volumes."""
    return float(np.cbrt(abs(np.linalg.det(linear))))
