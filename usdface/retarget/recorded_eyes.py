"""The eyes of a take of weights on a character whose eyes turn by joints."""

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.driven_shapes import undecided
from usdface.face.eye_joints import eye_joints, is_turned_by_shapes
from usdface.face.gaze_curves import Side, gaze_angles, is_gaze_curve
from usdface.face.shape_names import shape_key
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.head_joint import face_joint
from usdface.retarget.joint_motion import JointMotion, named_joint
from usdface.rigs import Mesh, Rig, Skeleton
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

__all__ = ["recorded_eyes", "turning_joints"]

_SIDES: tuple[Side, Side] = ("left", "right")


def recorded_eyes(
    take: WeightsTake, rig: Rig, mesh: Mesh, setup: RetargetSetup
) -> tuple[tuple[JointMotion, ...], list[Finding]]:
    """Return the motion of the joints that turn the character's eyes as the gaze curves say.

    Eyes that blend shapes of gaze turn have none, unless the setup names their joints.

    Parameters
    ----------
    take : WeightsTake
    rig : Rig
    mesh : Mesh
        The bound one.
    setup : RetargetSetup

    Returns
    -------
    tuple of JointMotion
        One for each eye; () where no joint of a skeleton that carries the face turns them.
    list of Finding
        GAZE_BY_JOINTS, if they turn, and CHANNEL_IGNORED for gaze curves that turn nothing.

    Raises
    ------
    InputError
        If the setup names a joint that the skeleton has not.
    """
    angles = gaze_angles(take.names, take.weights)
    if not angles or setup.eye_turn == 0.0:
        return (), []
    skeleton = rig.skeleton if face_joint(rig.skeleton, mesh, setup) is not None else None
    joints = {side: joint for side, joint in turning_joints(rig, setup).items() if side in angles}
    if skeleton is None:
        joints = {}
    idle, _ = undecided(take.names, rig.shape_names, setup.curves)
    unused = [n for n in idle if is_gaze_curve(n) and shape_key(n)[1] not in joints]
    findings = []
    if unused:
        message = "curves of gaze without a blend shape, or a joint of an eye: {channels}"
        findings.append(finding("CHANNEL_IGNORED", take.source, message, unused))
    if skeleton is None or not joints:
        return (), findings
    names = [skeleton.joints[joint] for joint in joints.values()]
    message = "the eyes turn by {joints}, as the curves of gaze say"
    motions = tuple(
        JointMotion(joint, _turned(skeleton, joint, setup.eye_turn * angles[side]))
        for side, joint in joints.items()
    )
    return motions, [*findings, finding("GAZE_BY_JOINTS", mesh.path, message, names)]


def turning_joints(rig: Rig, setup: RetargetSetup) -> dict[Side, int]:
    """Return the joints that turn a rig's eyes: as named, else of eyes that no shape turns."""
    if rig.skeleton is None:
        return {}
    if setup.eye_joints:
        named = zip(_SIDES, setup.eye_joints, strict=True)
        return {side: named_joint(rig.skeleton, name) for side, name in named}
    found = eye_joints(rig)
    return {side: j for side, j in found.items() if not is_turned_by_shapes(rig, j)}


def _turned(skeleton: Skeleton, joint: int, angles: FloatArray) -> Pose:
    """Return the turn of an eye about its joint, by yaw and pitch (F, 2) [rad]."""
    euler = np.stack([angles[:, 0], -angles[:, 1]], axis=1)
    rotations = Rotation.from_euler("YX", euler).as_matrix()
    pivot = skeleton.bind[joint][3, :3]
    return Pose(rotations, pivot - rotations @ pivot)
