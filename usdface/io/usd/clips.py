"""Clips from USD: the SkelAnimations of a character, one for each variant that binds one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.transforms import decompose, followed_by
from usdface.io.usd.clip_variants import (
    BoundAnimation,
    bound_animations,
    clip_stages,
    playing_animations,
    report_unbound,
)
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rigid_animation import (
    RigidMotion,
    add_rigid_joints,
    find_rigid_motions,
    merge_joint_takes,
    skeleton_prefix,
)
from usdface.io.usd.skeleton import parent_frames
from usdface.io.usd.stage import metrics_of, to_si
from usdface.rigs import Rig, Skeleton
from usdface.takes import WeightsTake

__all__ = ["animated_rig", "clips_of_stage"]

_SAME_SCALE = 1e-5  # a fiftieth of the step of 16-bit scales at 1 (2**-11)
_POSED = 1e-5  # of a matrix: SkelAnimations hold float32, and scales of 16 bits near 1
_SAME_WEIGHT = 1e-6  # 8 roundings of float32
_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def animated_rig(
    stage: Usd.Stage, asset_root: Path | None = None
) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    """Return the meshes under all SkelRoots as one rig, and its clips.

    Rigid motion, by the transform of a prim, becomes a joint of its own.
    See `usdface.io.usd.rig.rig_of_stage` and `clips_of_stage`.
    """
    rig, found = rig_of_stage(stage, asset_root=asset_root)
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        motions = find_rigid_motions(stage, rig)
        found += _report_skinning_method(stage, rig)
    clips, clip_findings = clips_of_stage(stage, rig, motions=motions)
    return add_rigid_joints(rig, motions), clips, found + clip_findings


def _report_skinning_method(stage: Usd.Stage, rig: Rig) -> list[Finding]:
    found = []
    for mesh in rig.meshes:
        primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(mesh.path))
        method = primvars.FindPrimvarWithInheritance(UsdSkel.Tokens.primvarsSkelSkinningMethod)
        if mesh.skin is not None and method and method.Get() == UsdSkel.Tokens.dualQuaternion:
            message = "dual quaternion skinning becomes linear"
            found.append(finding("FEATURE_DROPPED", mesh.path, message))
    return found


def clips_of_stage(
    stage: Usd.Stage, rig: Rig, root: str = "", motions: Sequence[RigidMotion] = ()
) -> tuple[tuple[Clip, ...], list[Finding]]:
    """Return the clips of the SkelAnimations that are bound under the SkelRoots.

    Times are seconds from the stage's start time code where it has one before the first
    sample, else from that sample. The clock is timeCodesPerSecond. A clip has the display name
    of its SkelAnimation, else the prim's name; the one that the stage shows comes first.

    Parameters
    ----------
    stage : Usd.Stage
    rig : Rig
        As `usdface.io.usd.rig.rig_of_stage` reads it off the stage.
    root : str
        Path of a prim that the SkelRoots are under; "" = the whole stage.
    motions : sequence of RigidMotion
        Rigid motions, which become joints (`usdface.io.usd.rigid_animation`).

    Raises
    ------
    InputError
        If there is no SkelRoot, a sample does not have one weight for each name, or a name
        occurs twice.
    """
    clips: list[Clip] = []
    found: list[Finding] = []
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        played: set[Sdf.Path] = set()
        for variation in clip_stages(stage, root):
            clip, new_findings = _clip(variation, rig, root, motions)
            found += new_findings
            played |= {*playing_animations(variation)}
            if clip is not None:
                clips.append(clip)
        found += report_unbound(stage, root, played)
    moving = [clip for clip in clips if not clip.still]
    still = [clip for clip in clips if clip.still]
    if moving:  # one of several variants may stand still: its weights, but no pose of joints
        weights = next((c.weights for c in still if c.weights), _defaults(stage, root))
        still = [Clip("", weights)] if weights else []
    return (*moving, *still[:1]), list(dict.fromkeys(found))


def _defaults(stage: Usd.Stage, root: str) -> WeightsTake | None:
    """Return the weights that SkelAnimations with samples have without time, if not all are 0."""
    standing = (_static_weights(b.animation) for b in bound_animations(stage, root))
    return next((weights for weights in standing if weights), None)


def _clip(
    stage: Usd.Stage, rig: Rig, root: str, motions: Sequence[RigidMotion]
) -> tuple[Clip | None, list[Finding]]:
    playing_now = bound_animations(stage, root)
    animations = {b.animation.GetPrim(): b.animation for b in playing_now}
    weighted = [q for q in animations.values() if q.GetBlendShapeWeightTimeSamples()]
    jointed = [
        b
        for b in playing_now
        if rig.skeleton is not None
        and tuple(map(str, b.skeleton.GetJointOrder())) == rig.skeleton.joints
        and (b.animation.GetJointTransformTimeSamples() or _is_posed(b))
    ]
    codes = np.unique(
        [
            *(code for q in weighted for code in q.GetBlendShapeWeightTimeSamples()),
            *(code for b in jointed[:1] for code in b.animation.GetJointTransformTimeSamples()),
            *(code for motion in motions for code in motion.codes),
        ]
    )
    found: list[Finding] = []
    metrics = metrics_of(stage)
    if not len(codes):
        still = next((w for q in animations.values() if (w := _static_weights(q))), None)
        pose = None
        if jointed and rig.skeleton is not None:
            pose, found = _joints(jointed[0], rig.skeleton, to_si(metrics), _Clock(0.0, 1.0))
        return (Clip("", still, pose) if still or pose else None), found
    start = metrics.start if stage.HasAuthoredTimeCodeRange() else codes[0]
    clock = _Clock(min(start, float(codes[0])), metrics.time_codes_per_second)
    weights, new_findings = _merged_weights(weighted, clock)
    found += new_findings
    takes = [_joint_take(motion, clock) for motion in motions]
    if jointed and rig.skeleton is not None:
        joints, new_findings = _joints(jointed[0], rig.skeleton, to_si(metrics), clock)
        found += new_findings
        if joints is not None:
            above = skeleton_prefix(rig, motions)
            takes.append(replace(joints, joints=tuple(above + joint for joint in joints.joints)))
    prims = [
        q.GetPrim() for q in (*weighted, *(b.animation for b in jointed), *animations.values())
    ]
    name = prims[0].GetDisplayName() or prims[0].GetName() if prims else motions[0].name
    return Clip(name, weights, merge_joint_takes(takes)), found


def _joint_take(motion: RigidMotion, clock: "_Clock") -> JointsTake:
    moves, turns, sizes = (part[:, None] for part in decompose(motion.matrices))
    times = clock.times(motion.codes)
    return JointsTake((motion.joint,), times, moves, turns, sizes, clock.grid(times))


@dataclass(frozen=True, slots=True)
class _Clock:
    start: float
    rate: float

    def times(self, codes: FloatArray) -> FloatArray:
        return np.asarray((codes - self.start) / self.rate)

    def grid(self, times: FloatArray) -> float:
        """Return the frame rate [Hz] of samples at `times`."""
        step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
        return round(1 / step, 6) if step > 0 else self.rate


def _names(query: UsdSkel.AnimQuery) -> tuple[str, ...]:
    return tuple(str(token) for token in query.GetBlendShapeOrder())


def _is_posed(binding: BoundAnimation) -> bool:
    """Whether a SkelAnimation without samples holds joints elsewhere than at rest."""
    order = list(binding.skeleton.GetJointOrder())
    rest = binding.skeleton.ComputeJointLocalTransforms(0.0, True)
    shown = binding.skeleton.ComputeJointLocalTransforms(0.0)
    if not order or rest is None or shown is None:
        return False
    return not np.allclose(np.array(shown), np.array(rest), rtol=_POSED, atol=_POSED)


def _static_weights(query: UsdSkel.AnimQuery) -> WeightsTake | None:
    """Return weights that do not move, if some are not zero."""
    row = UsdSkel.Animation(query.GetPrim()).GetBlendShapeWeightsAttr().Get()
    names = _names(query)
    if row is None or len(row) != len(names) or not any(row):
        return None
    return WeightsTake(names, np.zeros(1), np.array([row], np.float64))


def _weights(query: UsdSkel.AnimQuery, clock: _Clock) -> WeightsTake:
    names = _names(query)
    codes = np.array(query.GetBlendShapeWeightTimeSamples())
    values = UsdSkel.Animation(query.GetPrim()).GetBlendShapeWeightsAttr()
    rows = []
    for code in codes:
        row = np.asarray(values.Get(float(code)), np.float64)
        if row.shape != (len(names),):
            raise InputError(
                f"{query.GetPrim().GetPath()} has {row.size} blendShapeWeights for {len(names)} "
                f"blendShapes at time code {code:g}",
                "WEIGHTS_LENGTH_WRONG",
            )
        rows.append(row)
    times = clock.times(codes)
    return WeightsTake(names, times, np.array(rows), clock.grid(times))


def _merged_weights(
    queries: Sequence[UsdSkel.AnimQuery], clock: _Clock
) -> tuple[WeightsTake | None, list[Finding]]:
    """Return the weights of all SkelAnimations that play at once; of equal names the first."""
    takes = [_weights(query, clock) for query in queries]
    if len(takes) < 2:
        return (takes[0] if takes else None), []
    times = np.unique(np.concatenate([take.times for take in takes]))
    columns: dict[str, FloatArray] = {}
    found = []
    for query, take in zip(queries, takes, strict=True):
        for name, curve in zip(take.names, take.weights.T, strict=True):
            own = np.interp(times, take.times, curve)
            if not np.allclose(columns.setdefault(name, own), own, rtol=0, atol=_SAME_WEIGHT):
                message = f"{name!r} moves otherwise in another SkelAnimation, which comes first"
                found.append(finding("ANIMATION_DROPPED", str(query.GetPrim().GetPath()), message))
    weights = np.stack([*columns.values()], 1)
    return WeightsTake(tuple(columns), times, weights, max(t.rate for t in takes)), found


def _joints(
    binding: BoundAnimation, skeleton: Skeleton, si: FloatArray, clock: _Clock
) -> tuple[JointsTake | None, list[Finding]]:
    """Return the animated joints in the rig's frames (`usdface.io.usd.skeleton`)."""
    where = str(binding.animation.GetPrim().GetPath())
    order = tuple(map(str, binding.animation.GetJointOrder()))
    known = [k for k, joint in enumerate(order) if joint in skeleton.joints]
    found = []
    if len(known) < len(order):
        message = f"{len(order) - len(known)} animated joints are not in the skeleton"
        found.append(finding("ANIMATION_DROPPED", where, message))
    codes = np.array(binding.animation.GetJointTransformTimeSamples() or [clock.start])
    rows = [binding.animation.ComputeJointLocalTransformComponents(float(c)) for c in codes]
    if not known or any(row is None or any(len(p) != len(order) for p in row) for row in rows):
        message = "translations, rotations and scales do not fit the joints"
        return None, [*found, finding("ANIMATION_DROPPED", where, message)]
    moves, turns, sizes = (
        np.array([np.asarray(row[k], np.float64) for row in rows]) for k in range(3)
    )
    turns = _unit(turns)
    xforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    world = xforms.GetLocalToWorldTransform(binding.skeleton.GetPrim())
    scale, below = parent_frames(skeleton.joints, np.array(world, np.float64) @ si)
    _, _, rests = decompose(skeleton.rest)
    parts = []
    for k in known:
        place = skeleton.joints.index(order[k])
        move, turn, size = followed_by(moves[:, k], turns[:, k], sizes[:, k], below[place])
        size = size / scale
        # 16 bits hold few scales: next to that at rest, the joint is at rest.
        size = np.where(np.abs(size - rests[place]) < _SAME_SCALE, rests[place], size)
        parts.append((move, turn, size))
    times = clock.times(codes)
    moves, turns, sizes = (np.stack(values, 1) for values in zip(*parts, strict=True))
    joints = tuple(order[k] for k in known)
    return JointsTake(joints, times, moves, turns, sizes, clock.grid(times)), found


def _unit(rotations: FloatArray) -> FloatArray:
    length = np.linalg.norm(rotations, axis=-1, keepdims=True)
    identity = np.array([0.0, 0.0, 0.0, 1.0])
    return np.where(length > 0, rotations / np.where(length > 0, length, 1.0), identity)
