"""The joint of a skeleton that carries the face."""

import numpy as np

from usdface.errors import InputError
from usdface.face.face_points import FacePoints, face_points
from usdface.retarget.joint_motion import named_joint
from usdface.rigs import Mesh, Skeleton, Skin
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["carrying_joint", "face_joint"]

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
    parents = skeleton.parents
    for joint in reversed(range(count)):
        if parents[joint] >= 0:
            shares[parents[joint]] += shares[joint]
    whole = sum(shares[joint] for joint in range(count) if parents[joint] < 0)
    carrying = [joint for joint in range(count) if shares[joint] >= _CARRIED * whole]
    return max(carrying, key=lambda joint: skeleton.joints[joint].count("/"), default=None)


def face_joint(skeleton: Skeleton | None, mesh: Mesh, setup: RetargetSetup) -> int | None:
    """Return the joint that carries the face of a mesh: the named one, else as found; None without.

    Raises
    ------
    InputError
        If the setup names a joint that the skeleton has not, or no skeleton moves the mesh.
    """
    if skeleton is None or mesh.skin is None:
        if setup.head_joint:
            raise InputError(
                f"the head's joint is {setup.head_joint!r}, but no skeleton with joints moves "
                f"{mesh.path or 'the mesh'}; leave it out, and the SkelRoot moves",
                "JOINT_UNKNOWN",
            )
        return None
    if setup.head_joint:
        return named_joint(skeleton, setup.head_joint)
    return carrying_joint(skeleton, mesh.skin, face_points(mesh, setup.binding.points))
