"""Motion that a character has of its own, beside that of a take."""

from collections.abc import Collection, Sequence

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.findings import Finding, finding
from usdface.io.transforms import compose
from usdface.io.usd.animated_joints import animated_joints
from usdface.io.usd.head_motion import JointCarrier
from usdface.io.usd.rigid_animation import transform_time_codes
from usdface.io.usd.shot import ShotPrims, StagedShot
from usdface.io.usd.skel_bindings import skinned_by
from usdface.io.usd.world_transforms import world_transform
from usdface.schemas import tokens
from usdface.shot.shot import ShotResult

__all__ = ["own_joints", "report_hidden_weights", "report_replaced", "report_unmoved"]

# Of a component of a matrix, a weight: float32, and scales of 16 bits near 1, stay below.
_MOVED = 1e-4


def report_replaced(staged: StagedShot, result: ShotResult) -> list[Finding]:
    """Return ANIMATION_DROPPED for joints whose own motion that of head and eyes replaces.

    Beyond the take, too, where these joints stay as in its first or last frame.
    """
    carrier = staged.prims.head
    if not isinstance(carrier, JointCarrier):
        return []  # a SkelRoot keeps its own transforms
    joints = carrier.skeleton.joints
    head = (joints[carrier.joint],) if result.head_motion is not None else ()
    replaced = {*head, *(joints[each.joint] for each in result.eye_motions)}
    own = [j for j in _moving_joints(staged, beyond=True) if j in replaced]
    found = []
    for joint in own:
        keep = "; `process --no-head` keeps it" if joint in head else ""
        message = "the character's own motion of joint {joint} is replaced by the take's" + keep
        found.append(finding("ANIMATION_DROPPED", staged.prims.animation, message, joint))
    return found


def report_hidden_weights(staged: StagedShot) -> list[Finding]:
    """Return ANIMATION_DROPPED where a character's own weights change beyond the take.

    The arrays of a result hide all samples of its own ones.
    """
    prims, codes = staged.prims, staged.codes
    animation = UsdSkel.Animation.Get(staged.stage, prims.animation) if prims.animation else None
    attribute = animation.GetBlendShapeWeightsAttr() if animation else None
    if not attribute or _is_of_a_result(attribute, prims):
        return []
    keys = np.array(attribute.GetTimeSamples())
    keys = keys[(keys < codes[0]) | (keys > codes[-1])]
    changed = [
        code
        for code in keys.tolist()
        if _differ(attribute.Get(code), attribute.Get(float(np.clip(code, codes[0], codes[-1]))))
    ]
    if not changed:
        return []
    message = (
        "the character's own weights change beyond the take, at time codes {first_code:g} to "
        "{last_code:g}; the result stays as in the first and last frame of the take there"
    )
    where = prims.animation
    return [finding("ANIMATION_DROPPED", where, message, changed[0], changed[-1])]


def _differ(one: Sequence[float] | None, other: Sequence[float] | None) -> bool:
    if one is None or other is None:  # a sample is blocked
        return one is not other
    return len(one) != len(other) or not np.allclose(one, other, rtol=0.0, atol=_MOVED)


def _moving_joints(staged: StagedShot, *, beyond: bool = False) -> tuple[str, ...]:
    """Return the joints that the animation of a shot moves between the frames of the take.

    Or `beyond` them, too. Not by the result of an earlier run.
    """
    prims, codes = staged.prims, staged.codes
    animation = UsdSkel.Animation.Get(staged.stage, prims.animation) if prims.animation else None
    if not animation or _is_of_a_result(animation.GetRotationsAttr(), prims):
        return ()
    query = UsdSkel.Cache().GetAnimQuery(animation)
    if not query or not query.JointTransformsMightBeTimeVarying():
        return ()
    names = tuple(map(str, query.GetJointOrder()))
    keys = np.array(query.GetJointTransformTimeSamples())
    if not beyond:
        keys = keys[(keys > codes[0]) & (keys < codes[-1])]
    moments = np.unique([codes[0], *keys, codes[-1]]).tolist()
    poses = [query.ComputeJointLocalTransforms(code) for code in moments]
    if any(pose is None or len(pose) != len(names) for pose in poses):
        return ()
    moved = np.ptp(np.array([np.array(pose) for pose in poses]), axis=0).max(axis=(1, 2)) > _MOVED
    return tuple(name for name, moves in zip(names, moved, strict=True) if moves)


def _is_of_a_result(rotations: Usd.Attribute, prims: ShotPrims) -> bool:
    residual = Sdf.Path(prims.retarget).AppendProperty(tokens.RESIDUAL)
    strongest = rotations.GetPropertyStack()[:1]
    return any(spec.layer.GetPropertyAtPath(residual) for spec in strongest)


def own_joints(staged: StagedShot, times: FloatArray, apart: Collection[str]) -> JointsTake | None:
    """Return the joints that the animation of a shot holds elsewhere than at rest, or moves.

    At the frames of the take, whose `times` (F,) are given, in seconds; without the joints `apart`.
    """
    skeleton, prims = staged.shot.rig.skeleton, staged.prims
    prim = staged.stage.GetPrimAtPath(prims.skeleton)
    query = UsdSkel.Cache().GetAnimQuery(
        UsdSkel.Animation.Get(staged.stage, prims.animation or "/")
    )
    names = tuple(map(str, UsdSkel.Skeleton(prim).GetJointsAttr().Get() or ()))
    if not query or skeleton is None or names != skeleton.joints:
        return None
    to_rig = world_transform(prim, Usd.TimeCode.EarliestTime()) @ staged.to_rig
    moved = animated_joints(query, skeleton, to_rig, staged.codes.tolist())
    if moved is None:
        return None
    rest = skeleton.rest[[skeleton.joints.index(name) for name in moved.names]]
    away = np.abs(compose(*moved[1:]) - rest).max(axis=(0, 2, 3)) > _MOVED
    kept = [k for k, name in enumerate(moved.names) if away[k] and name not in apart]
    if not kept:
        return None
    moves, turns, sizes = (part[:, kept] for part in moved[1:])
    return JointsTake(tuple(moved.names[k] for k in kept), times, moves, turns, sizes)


def report_unmoved(staged: StagedShot, kept: Collection[str]) -> list[Finding]:
    """Return ANIMATION_DROPPED for own motion that a glTF of the shot leaves out.

    Of joints that are not among those `kept`, and of prims whose transforms change over time.
    """
    found = []
    message = "own motion of joint {joint} is left out; `usdface export` of the result keeps it"
    for joint in _moving_joints(staged):
        if joint not in kept:
            found.append(finding("ANIMATION_DROPPED", staged.prims.animation, message, joint))
    skeletons, moving = skinned_by(staged.stage), dict[Sdf.Path, None]()
    for mesh in staged.shot.rig.meshes:
        prim = skeletons.get(mesh.path) or staged.stage.GetPrimAtPath(mesh.path)
        moving |= dict.fromkeys(transform_time_codes(prim))
    message = "its transform changes over time; `usdface export` of the result keeps that"
    return found + [finding("ANIMATION_DROPPED", str(path), message) for path in moving]
