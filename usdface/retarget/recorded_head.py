"""The head's motion of a take of weights, as its recorder turned it: rotations about a pivot."""

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.face_points import FacePoints, face_points
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.head_joint import face_joint
from usdface.rigs import Mesh, Rig
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

__all__ = ["recorded_head"]

# Share of the motion that is left out at each side of the box around a face.
_LEFT_OUT = 0.02
# Heights of the face below it down to which a mesh is a head, with neck and shoulders: ICT's has
# 1.0, MakeHuman's body 13. By hand.
_BUST = 3.0


def recorded_head(
    take: WeightsTake, rig: Rig, mesh: Mesh, setup: RetargetSetup
) -> tuple[Pose | None, list[Finding]]:
    """Return the motion of the character's head from its neutral position; None without one.

    The head turns from where it is in the neutral frames, about its own axes; if they are the
    rig's, from straight ahead. It turns about the joint that carries the face. Where that is a root
    joint that is no head's, or none, it turns about the middle of the head; not on a body.

    Parameters
    ----------
    take : WeightsTake
    rig : Rig
    mesh : Mesh
        The bound one.
    setup : RetargetSetup

    Returns
    -------
    Pose or None
        In the character's space, for points of the character at rest.
    list of Finding
        HEAD_PIVOT_ASSUMED, or HEAD_LEFT_STILL.
    """
    if take.head is None:
        return None, []
    turns = Rotation.from_rotvec(take.head.copy())  # SciPy before 1.15.1 wants to write
    if setup.neutral is not None:
        first, last = setup.neutral
        turns = turns[first : last + 1].mean().inv() * turns
    face = face_points(mesh, setup.binding.points)
    of_joint = _joint_place(rig, mesh, setup)
    findings = []
    if of_joint is not None:
        pivot = of_joint
    elif len(face.vertices) and not _has_body(mesh, face):
        pivot = _middle(mesh, face)
        message = (
            "the head turns about the middle of the head, {height_m:.3g} m high, as no joint below "
            "a root carries the face"
        )
        findings = [finding("HEAD_PIVOT_ASSUMED", mesh.path, message, float(pivot[1]))]
    else:
        return None, [finding("HEAD_LEFT_STILL", mesh.path)]
    rotations = turns.as_matrix()
    return Pose(rotations, pivot - rotations @ pivot), findings


def _joint_place(rig: Rig, mesh: Mesh, setup: RetargetSetup) -> FloatArray | None:
    """Return where the joint that carries the face is, (3,) [m]; None for a root that is not named.

    Such a root, as rigs without a skeleton get one, may be anywhere.
    """
    skeleton, joint = rig.skeleton, face_joint(rig.skeleton, mesh, setup)
    if skeleton is None or joint is None:
        return None
    below = "/" in skeleton.joints[joint] or "head" in skeleton.names[joint].lower()
    return skeleton.bind[joint][3, :3] if below or setup.head_joint else None


def _has_body(mesh: Mesh, face: FacePoints) -> bool:
    """Return whether a mesh goes on below the neck, further than a bust does."""
    low, high = face.box(mesh.points, _LEFT_OUT)
    return bool(mesh.points[:, 1].min() < low[1] - _BUST * (high[1] - low[1]))


def _middle(mesh: Mesh, face: FacePoints) -> FloatArray:
    """Return the middle of the head at the height of the middle of the face (3,) [m].

    The skull turns on the spine behind the mouth (the atlas), half the head's depth away from it.
    """
    low, high = face.box(mesh.points, _LEFT_OUT)
    middle = (low + high) / 2
    around = np.abs(mesh.points[:, :2] - middle[:2]) <= (high - low)[:2] / 2
    depths = mesh.points[around.all(axis=1), 2]
    return np.array([middle[0], middle[1], (depths.min() + depths.max()) / 2])
