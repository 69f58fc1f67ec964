"""Recorded eyes on a character: by joints, or by blend shapes of gaze."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.curve_mapping import undecided
from usdface.face.eye_joints import eye_joints, is_turned_by_shapes
from usdface.face.gaze_curves import Side, gaze_angles, gaze_curves_of
from usdface.face.plain_names import shape_keys
from usdface.face.weights_from_neutral import weights_from_neutral
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.head_joint import face_joint
from usdface.retarget.joint_motion import JointMotion, named_joint
from usdface.retarget.recorded_gaze import gaze_shapes, recorded_gaze
from usdface.rigs import Mesh, Rig, Skeleton
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["recorded_eyes", "turning_joints"]

_SIDES: tuple[Side, Side] = ("left", "right")


def recorded_eyes(
    take: MarkerTake | WeightsTake, rig: Rig, mesh: Mesh, setup: RetargetSetup
) -> tuple[tuple[JointMotion, ...], list[Finding]]:
    """Return the motion of the joints that turn the character's eyes as they were recorded.

    Eyes that blend shapes of gaze turn have none, unless the setup names their joints.

    Parameters
    ----------
    take : MarkerTake or WeightsTake
        With a gaze, or with curves of gaze.
    rig : Rig
    mesh : Mesh
        The bound one.
    setup : RetargetSetup

    Returns
    -------
    tuple of JointMotion
        One for each eye; () where no joint of a skeleton that carries the face turns them.
    list of Finding
        GAZE_BY_JOINTS, if they turn, and CHANNEL_IGNORED for gaze curves that turn nothing; of a
        marker take GAZE_RECORDED or GAZE_UNSHOWN.

    Raises
    ------
    InputError
        If the setup names a joint that the skeleton has not.
    """
    angles = _angles(take, setup)
    if not angles:
        return (), []
    skeleton = rig.skeleton if face_joint(rig.skeleton, mesh, setup) is not None else None
    joints: dict[Side, int] = {}
    if skeleton is not None and setup.eye_turn > 0.0:
        found = turning_joints(rig, setup)
        joints = {side: joint for side, joint in found.items() if side in angles}
    findings = _shown(take, rig, setup, joints)
    if skeleton is None or not joints:
        return (), findings
    motions = tuple(
        JointMotion(joint, _turned(skeleton, joint, setup.eye_turn * angles[side]))
        for side, joint in joints.items()
    )
    names = [skeleton.joints[joint] for joint in joints.values()]
    message = "the eyes turn by {joints}, as they were recorded"
    return motions, [*findings, finding("GAZE_BY_JOINTS", mesh.path, message, names)]


def _angles(take: MarkerTake | WeightsTake, setup: RetargetSetup) -> dict[Side, FloatArray]:
    """Return yaw and pitch (F, 2) [rad] of each recorded eye."""
    if isinstance(take, WeightsTake):
        return gaze_angles(take.names, weights_from_neutral(take, setup)[0].weights)
    gaze = recorded_gaze(take, setup)
    if gaze is None:
        return {}
    seen = ~np.isnan(gaze[:, 0])
    bridged = [np.interp(take.times, take.times[seen], each[seen]) for each in gaze.T]
    return dict.fromkeys(_SIDES, np.stack(bridged, axis=1))


def _shown(
    take: MarkerTake | WeightsTake, rig: Rig, setup: RetargetSetup, joints: Mapping[Side, int]
) -> list[Finding]:
    """Report whether a recorded gaze is shown, and the part of it that is not."""
    if isinstance(take, MarkerTake):
        shown = joints or gaze_shapes(rig.shape_names) or setup.eye_turn == 0.0
        return [finding("GAZE_RECORDED" if shown else "GAZE_UNSHOWN", take.source)]
    idle, _ = undecided(take.names, rig.shape_names, setup.curves)
    gaze, keys = (
        gaze_curves_of(take.names),
        dict(zip(take.names, shape_keys(take.names), strict=True)),
    )
    unused = [name for name in idle if name in gaze and keys[name][1] not in joints]
    if not unused or setup.eye_turn == 0.0:
        return []
    message = "curves of gaze without a blend shape, or a joint of an eye: {channels}"
    return [finding("CHANNEL_IGNORED", take.source, message, unused)]


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
