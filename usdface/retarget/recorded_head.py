"""The head's motion of a take of weights, as its recorder turned it: rotations about a pivot."""

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.head_joint import carrying_joint, face_points, named_joint
from usdface.retarget_setup import RetargetSetup
from usdface.rigs import Mesh, Rig
from usdface.takes import WeightsTake

__all__ = ["recorded_head"]


def recorded_head(
    take: WeightsTake, rig: Rig, mesh: Mesh, setup: RetargetSetup
) -> tuple[Pose | None, list[Finding]]:
    """Return the motion of the character's head from its neutral position; None without one.

    The head turns from where it is in the neutral frames, about its own axes; if they are the
    rig's, from straight ahead. It turns about the joint that carries the face, as far as this is
    no root joint, else about the middle of the head.

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
        HEAD_PIVOT_ASSUMED.
    """
    if take.head is None:
        return None, []
    turns = Rotation.from_rotvec(take.head.copy())  # SciPy before 1.15.1 wants to write
    if setup.neutral is not None:
        first, last = setup.neutral
        last = min(last, len(take.times) - 1)
        turns = turns[min(first, last) : last + 1].mean().inv() * turns
    joint = _joint(rig, mesh, setup)
    findings = []
    if joint is None:
        pivot = _middle(mesh, setup)
        message = (
            "the head turns about the middle of the head, {height_m:.3g} m high, as no joint below "
            "a root carries the face"
        )
        findings = [finding("HEAD_PIVOT_ASSUMED", mesh.path, message, float(pivot[1]))]
    else:
        assert rig.skeleton is not None
        pivot = rig.skeleton.bind[joint][3, :3]
    rotations = turns.as_matrix()
    return Pose(rotations, pivot - rotations @ pivot), findings


def _joint(rig: Rig, mesh: Mesh, setup: RetargetSetup) -> int | None:
    """Return the joint that carries the face, unless it is a root that was not named."""
    if rig.skeleton is None or mesh.skin is None:
        return None
    if setup.head_joint:
        return named_joint(rig.skeleton, setup.head_joint)
    joint = carrying_joint(rig.skeleton, mesh.skin, face_points(mesh, setup.binding.points))
    return joint if joint is not None and "/" in rig.skeleton.joints[joint] else None


def _middle(mesh: Mesh, setup: RetargetSetup) -> FloatArray:
    """Return the middle of the head at the height of the middle of the face (3,) [m].

    The skull turns on the spine behind the mouth (the atlas), half the head's depth away from it.
    """
    face = mesh.points[face_points(mesh, setup.binding.points)]
    low, high = face.min(axis=0), face.max(axis=0)
    middle = np.median(face, axis=0)
    around = np.abs(mesh.points[:, :2] - middle[:2]) <= (high - low)[:2] / 2
    depths = mesh.points[around.all(axis=1), 2]
    return np.array([(low[0] + high[0]) / 2, middle[1], (depths.min() + depths.max()) / 2])
