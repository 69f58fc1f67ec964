"""Motion of a joint: its transforms that move the skin bound to it."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.geometry.rigid_fit import Pose
from usdface.rigs import Skeleton

__all__ = ["JointMotion", "joint_track", "matrices_of", "named_joint"]


@dataclass(frozen=True, slots=True)
class JointMotion:
    """The motion of a joint of a rig's skeleton, on top of that of its parent.

    Attributes
    ----------
    joint : int
    motion : Pose
        In rig space, for points as they are bound, F frames.
    """

    joint: int
    motion: Pose


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


def joint_track(skeleton: Skeleton, moved: JointMotion) -> FloatArray:
    """Return a joint's transforms to its parent that move its skin as given: (F, 4, 4).

    Row vectors, metres. The motion is applied in the bind pose and followed by the skeleton's rest
    pose, so that it stays relative to a neck that something else animates.

    Parameters
    ----------
    skeleton : Skeleton
    moved : JointMotion
    """
    bind, rest = skeleton.bind[moved.joint], skeleton.rest[moved.joint]
    return np.asarray(bind @ matrices_of(moved.motion) @ np.linalg.inv(bind) @ rest, np.float64)


def matrices_of(pose: Pose) -> FloatArray:
    """Return a pose as matrices for row vectors: (F, 4, 4)."""
    result = np.tile(np.eye(4), (len(pose.rotations), 1, 1))
    result[:, :3, :3] = pose.rotations.transpose(0, 2, 1)
    result[:, 3, :3] = pose.translations
    return result
