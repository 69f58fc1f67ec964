"""Motion that a character has of its own, and that of a take replaces."""

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.usd.shot import ShotPrims, StagedShot
from usdface.schemas import tokens
from usdface.shot import ShotResult

__all__ = ["moving_joints", "report_replaced"]

_MOVED = 1e-4  # of a component of a matrix: float32, and scales of 16 bits near 1, stay below


def report_replaced(stage: Usd.Stage, staged: StagedShot, result: ShotResult) -> list[Finding]:
    """Return ANIMATION_DROPPED for joints whose own motion that of head and eyes replaces."""
    carrier = staged.prims.head
    if carrier is None or carrier.skeleton is None:
        return []  # a SkelRoot keeps its own transforms
    joints = carrier.skeleton.joints
    head = (joints[carrier.joint],) if result.head_motion is not None else ()
    replaced = {*head, *(joints[each.joint] for each in result.eye_motions)}
    own = [j for j in moving_joints(stage, staged.prims, staged.codes) if j in replaced]
    found = []
    for joint in own:
        keep = "; `process --no-head` keeps it" if joint in head else ""
        message = "the character's own motion of joint {joint} is replaced by the take's" + keep
        found.append(finding("ANIMATION_DROPPED", staged.prims.animation, message, joint))
    return found


def moving_joints(stage: Usd.Stage, prims: ShotPrims, codes: FloatArray) -> tuple[str, ...]:
    """Return the joints that the animation of a shot moves between the time codes (F,).

    Not by the result of an earlier run.
    """
    animation = UsdSkel.Animation.Get(stage, prims.animation) if prims.animation else None
    if not animation or _is_of_a_result(animation.GetRotationsAttr(), prims):
        return ()
    query = UsdSkel.Cache().GetAnimQuery(animation)
    if not query or not query.JointTransformsMightBeTimeVarying():
        return ()
    names = tuple(map(str, query.GetJointOrder()))
    between = np.array(query.GetJointTransformTimeSamples())
    between = between[(between > codes[0]) & (between < codes[-1])]
    moments = np.unique([codes[0], *between, codes[-1]]).tolist()
    poses = [query.ComputeJointLocalTransforms(code) for code in moments]
    if any(pose is None or len(pose) != len(names) for pose in poses):
        return ()
    moved = np.ptp(np.array([np.array(pose) for pose in poses]), axis=0).max(axis=(1, 2)) > _MOVED
    return tuple(name for name, moves in zip(names, moved, strict=True) if moves)


def _is_of_a_result(rotations: Usd.Attribute, prims: ShotPrims) -> bool:
    residual = Sdf.Path(prims.retarget).AppendProperty(tokens.RESIDUAL)
    strongest = rotations.GetPropertyStack()[:1]
    return any(spec.layer.GetPropertyAtPath(residual) for spec in strongest)
