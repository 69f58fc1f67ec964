"""The joint of a skeleton that moves the face, and its transforms for a head motion."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.face.face_points import FacePoints
from usdface.geometry.rigid_fit import Pose
from usdface.rigs import Skeleton, Skin

__all__ = ["carrying_joint", "joint_track", "matrices_of", "named_joint"]

# A joint carries the face if it and its descendants have this share of the markers' skin weight:
# lids, lips and jaw may have joints of their own below the head's. Set by hand.
_CARRIED = 0.9


def carrying_joint(skeleton: Skeleton, skin: Skin, face: FacePoints) -> int | None:
    """Return the deepest joint that carries a face; None if none does.

    A joint carries the vertices that are bound to it or to a joint below it.
    """
    count = len(skeleton.joints)
    shares = np.zeros(count)
    held = face.shares[:, None] * skin.weights[face.vertices]
    np.add.at(shares, skin.joints[face.vertices].ravel(), held.ravel())
    if shares.sum() <= 0.0:
        return None
    parents = _parents(skeleton)
    for joint in range(count - 1, -1, -1):  # parents come before children
        if parents[joint] >= 0:
            shares[parents[joint]] += shares[joint]
    whole = sum(shares[joint] for joint in range(count) if parents[joint] < 0)
    carrying = [joint for joint in range(count) if shares[joint] >= _CARRIED * whole]
    return max(carrying, key=lambda joint: skeleton.joints[joint].count("/"), default=None)


def named_joint(skeleton: Skeleton, name: str) -> int:
    """Return the joint of that path, or the only one of that name.

    Raises
    ------
    InputError
        If there is none, or several.
    """
    if name in skeleton.joints:
        return skeleton.joints.index(name)
    ends = (joint.rpartition("/")[2] for joint in skeleton.joints)
    pairs = zip(ends, skeleton.names, strict=True)
    found = [joint for joint, names in enumerate(pairs) if name in names]
    if len(found) != 1:
        raise InputError(
            f"the skeleton has {len(found) or 'no'} joints named {name!r}; name the head's by its "
            f"path, one of {', '.join(skeleton.joints[:12])}",
            "JOINT_UNKNOWN",
        )
    return found[0]


def _parents(skeleton: Skeleton) -> list[int]:
    place = {joint: i for i, joint in enumerate(skeleton.joints)}
    return [place.get(joint.rpartition("/")[0], -1) for joint in skeleton.joints]


def joint_track(skeleton: Skeleton, joint: int, motion: Pose) -> FloatArray:
    """Return the joint's transforms to its parent that move its skin as `motion`: (F, 4, 4).

    Row vectors, metres. The motion is applied in the bind pose and followed by the skeleton's rest
    pose, so that it stays relative to a neck that something else animates.

    Parameters
    ----------
    skeleton : Skeleton
    joint : int
    motion : Pose
        In rig space, for points as they are bound.
    """
    bind = skeleton.bind[joint]
    moved = bind @ matrices_of(motion) @ np.linalg.inv(bind) @ skeleton.rest[joint]
    return np.asarray(moved, np.float64)


def matrices_of(pose: Pose) -> FloatArray:
    """Return a pose as matrices for row vectors: (F, 4, 4)."""
    result = np.tile(np.eye(4), (len(pose.rotations), 1, 1))
    result[:, :3, :3] = pose.rotations.transpose(0, 2, 1)
    result[:, 3, :3] = pose.translations
    return result
