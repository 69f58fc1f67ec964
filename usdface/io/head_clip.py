"""The motion of head and eyes as an animation of joints, for formats that move nothing else."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.geometry.rigid_fit import Pose
from usdface.io.transforms import decompose
from usdface.retarget.joint_motion import JointMotion, joint_track
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["head_clip"]


def head_clip(
    rig: Rig,
    joint: int | None,
    motion: Pose | None,
    times: FloatArray,
    eyes: Sequence[JointMotion],
) -> tuple[Rig, JointsTake]:
    """Return a rig and the animation that moves its head, its eyes, or both.

    Parameters
    ----------
    rig : Rig
    joint : int or None
        The joint that carries the face; None = none does, and all meshes hang on one of their own.
    motion : Pose or None
        Of the head, in rig space, F frames.
    times : (F,) float64 [s]
    eyes : sequence of JointMotion
        Only of a rig with a joint that carries the face.
    """
    skeleton = rig.skeleton
    if joint is None or skeleton is None:
        joint, rest = 0, np.eye(4)[None]
        skeleton = Skeleton(("head",), ("head",), rest, rest)
        rig = replace(rig, meshes=tuple(map(_moved_by_head, rig.meshes)), skeleton=skeleton)
    head = () if motion is None else (JointMotion(joint, motion),)
    tracks = [joint_track(skeleton, each) for each in (*head, *eyes)]
    names = tuple(skeleton.joints[each.joint] for each in (*head, *eyes))
    return rig, JointsTake(names, times, *decompose(np.stack(tracks, axis=1)))


def _moved_by_head(mesh: Mesh) -> Mesh:
    count = (len(mesh.points), 1)
    return replace(mesh, skin=Skin(np.zeros(count, np.int64), np.ones(count)))
