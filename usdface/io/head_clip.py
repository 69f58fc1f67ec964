"""The head's motion as an animation of joints, for formats that move nothing else."""

from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.geometry.rigid_fit import Pose
from usdface.io.transforms import decompose
from usdface.retarget.head_joint import joint_track
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["head_clip"]


def head_clip(rig: Rig, joint: int, motion: Pose, times: FloatArray) -> tuple[Rig, JointsTake]:
    """Return a rig and the animation that moves its head.

    Parameters
    ----------
    rig : Rig
    joint : int
        The joint that carries the face; -1 = none does, and all meshes hang on one of their own.
    motion : Pose
        In rig space, F frames.
    times : (F,) float64 [s]
    """
    if joint < 0 or rig.skeleton is None:
        joint, rest = 0, np.eye(4)[None]
        skeleton = Skeleton(("head",), ("head",), rest, rest)
        rig = replace(rig, meshes=tuple(map(_hung, rig.meshes)), skeleton=skeleton)
    assert rig.skeleton is not None
    moved, turned, sized = decompose(joint_track(rig.skeleton, joint, motion)[:, None])
    return rig, JointsTake((rig.skeleton.joints[joint],), times, moved, turned, sized)


def _hung(mesh: Mesh) -> Mesh:
    count = (len(mesh.points), 1)
    return replace(mesh, skin=Skin(np.zeros(count, np.int64), np.ones(count)))
