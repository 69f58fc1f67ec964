"""Clips from USD: the SkelAnimations of a character, one for each variant that binds one."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.animated_joints import animated_joints
from usdface.io.usd.clip_variants import (
    BoundAnimation,
    bound_animations,
    clips_and_losses,
    playing_animations,
    report_unbound,
)
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.metrics import metrics_of, to_si
from usdface.io.usd.motion_keys import continuous_parts
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rigid_animation import (
    RigidMotion,
    add_rigid_joints,
    find_rigid_motions,
    merge_joint_takes,
    prefixes,
)
from usdface.io.usd.shared_shapes import ShapeNames, separate_shapes
from usdface.io.usd.skel_bindings import spaces_of_meshes, staged_skeletons
from usdface.io.usd.skeletons import StagedSkeleton
from usdface.io.usd.vertex_cache import VertexCache, add_cache_shapes, find_vertex_caches
from usdface.rigs import Rig
from usdface.takes import WeightsTake, frame_step

__all__ = ["animated_rig", "clips_of_stage"]

_POSED = 1e-5  # of a matrix: SkelAnimations hold float32, and scales of 16 bits near 1
_SAME_WEIGHT = 1e-6  # 8 roundings of float32
_SAME_RATE = 5e-4  # of a rate: half of the way from 30 to 29.97 Hz
_OWN_NAMES: ShapeNames = {}
_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def animated_rig(
    stage: Usd.Stage, asset_root: Path | None = None, purposes: Collection[str] = ()
) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    """Return the meshes under all SkelRoots as one rig, and its clips.

    Rigid motion, by the transform of a prim, becomes a joint of its own, and points that change
    over time become blend shapes.
    See `usdface.io.usd.rig.rig_of_stage` and `clips_of_stage`.
    """
    rig, found = rig_of_stage(stage, asset_root=asset_root, caches=True, purposes=purposes)
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        rig, names, new_findings = separate_shapes(stage, rig)
        found += new_findings
        motions = find_rigid_motions(stage, rig)
        skeletons = staged_skeletons(stage)
        found += _report_skinning_method(stage, rig)
        caches, new_findings = find_vertex_caches(stage, rig, spaces_of_meshes(stage))
        rig, found = add_cache_shapes(rig, caches), found + new_findings
    clips, new_findings = clips_of_stage(stage, motions=motions, names=names, caches=caches)
    return add_rigid_joints(rig, motions, skeletons), clips, found + new_findings


def _report_skinning_method(stage: Usd.Stage, rig: Rig) -> list[Finding]:
    found = []
    for mesh in rig.meshes:
        primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(mesh.path))
        method = primvars.FindPrimvarWithInheritance(UsdSkel.Tokens.primvarsSkelSkinningMethod)
        if mesh.skin is not None and method and method.Get() == UsdSkel.Tokens.dualQuaternion:
            message = "dual quaternion skinning becomes linear"
            found.append(
                finding("FEATURE_DROPPED", mesh.path, message, feature="dual_quaternion_skinning")
            )
    return found


def clips_of_stage(
    stage: Usd.Stage,
    *,
    motions: Sequence[RigidMotion] = (),
    names: ShapeNames = _OWN_NAMES,
    caches: Sequence[VertexCache] = (),
) -> tuple[tuple[Clip, ...], list[Finding]]:
    """Return the clips of the SkelAnimations that are bound under the SkelRoots.

    Times are seconds from the stage's start time code where it has one before the first
    sample, else from that sample. The clock is timeCodesPerSecond. A clip has the display name
    of its SkelAnimation, else the prim's name; the one that the stage shows comes first.

    Parameters
    ----------
    stage : Usd.Stage
    motions : sequence of RigidMotion
        Rigid motions, which become joints (`usdface.io.usd.rigid_animation`).
    names : mapping
        Of shapes that the rig names otherwise (`usdface.io.usd.shared_shapes`).
    caches : sequence of VertexCache
        Points that change over time (`usdface.io.usd.vertex_cache`), in every clip.

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
        scene = _Scene(staged_skeletons(stage), motions, names, caches)
        variations, found = clips_and_losses(stage)
        for variation in variations:
            clip, new_findings = _clip(variation, scene)
            found += new_findings
            played |= {*playing_animations(variation)}
            if clip is not None:
                clips.append(clip)
        found += report_unbound(stage, played)
    moving = [clip for clip in clips if not clip.still]
    still = [clip for clip in clips if clip.still]
    if moving:  # one of several variants may stand still: its weights, but no pose of joints
        weights = next((c.weights for c in still if c.weights), _defaults(stage, names))
        still = [Clip("", weights)] if weights else []
    return (*moving, *still[:1]), list(dict.fromkeys(found))


def _defaults(stage: Usd.Stage, names: ShapeNames) -> WeightsTake | None:
    """Return the weights that SkelAnimations with samples have without time, if not all are 0."""
    return _merged_defaults(bound_animations(stage), names)


@dataclass(frozen=True, eq=False, slots=True)
class _Scene:
    """Parts of a stage that all of its clips share."""

    skeletons: tuple[StagedSkeleton, ...]
    motions: Sequence[RigidMotion]
    names: ShapeNames
    caches: Sequence[VertexCache]

    def skeleton(self, bound: BoundAnimation) -> StagedSkeleton | None:
        path = bound.prim.GetPath()
        return next((one for one in self.skeletons if one.path == path), None)


def _clip(stage: Usd.Stage, scene: _Scene) -> tuple[Clip | None, list[Finding]]:
    playing_now = bound_animations(stage)
    # One may move several skeletons, whose shapes the rig may name otherwise.
    animations = {(b.animation.GetPrim(), _names(b, scene.names)): b for b in playing_now}
    weighted = [b for b in animations.values() if b.animation.GetBlendShapeWeightTimeSamples()]
    jointed = [
        (b, skeleton)
        for b in playing_now
        if (skeleton := scene.skeleton(b)) is not None
        and (b.animation.GetJointTransformTimeSamples() or _is_posed(b))
    ]
    codes = np.unique(
        [
            *(code for b in weighted for code in b.animation.GetBlendShapeWeightTimeSamples()),
            *(code for b, _ in jointed for code in b.animation.GetJointTransformTimeSamples()),
            *(code for motion in scene.motions for code in motion.codes),
            *(code for cache in scene.caches for code in cache.codes),
        ]
    )
    metrics = metrics_of(stage)
    start = metrics.start if stage.HasAuthoredTimeCodeRange() or not len(codes) else codes[0]
    clock = _Clock(min([start, *codes[:1]]), metrics.time_codes_per_second)
    takes = [_joint_take(motion, clock) for motion in scene.motions]
    above = prefixes(scene.skeletons, scene.motions)
    found: list[Finding] = []
    for bound, skeleton in jointed:
        joints, new_findings = _joints(bound, skeleton, to_si(metrics), clock)
        found += new_findings
        if joints is not None:
            prefix = above[skeleton.path]
            takes.append(replace(joints, joints=tuple(prefix + joint for joint in joints.joints)))
    pose = merge_joint_takes(takes)
    if not len(codes):
        still = _merged_defaults(list(animations.values()), scene.names)
        return (Clip("", still, pose) if still or pose else None), found
    weights, new_findings = _merged_weights(weighted, scene.names, clock)
    found += new_findings
    for cache in scene.caches:
        weights = _side_by_side(weights, cache.take(clock.times(cache.codes)))
    shown = [*weighted, *(bound for bound, _ in jointed), *animations.values()]
    prims = [bound.animation.GetPrim() for bound in shown]
    motions = [motion.name for motion in scene.motions]
    motions += [Sdf.Path(cache.path).name for cache in scene.caches]
    name = prims[0].GetDisplayName() or prims[0].GetName() if prims else motions[0]
    return Clip(name, weights, pose), found


def _joint_take(motion: RigidMotion, clock: "_Clock") -> JointsTake:
    moves, turns, sizes = (part[:, None] for part in continuous_parts(motion.matrices))
    times = clock.times(motion.codes)
    return JointsTake((motion.joint,), times, moves, turns, sizes, clock.grid(times))


@dataclass(frozen=True, slots=True)
class _Clock:
    start: float
    rate: float

    def times(self, codes: FloatArray) -> FloatArray:
        return np.asarray((codes - self.start) / self.rate)

    def grid(self, times: FloatArray) -> float:
        """Return the frame rate [Hz] of samples at `times`: the stage's or their own."""
        step = frame_step(times)
        if step <= 0 or abs(1 / step - self.rate) < _SAME_RATE * self.rate:
            return self.rate
        return round(1 / step, 6)


def _names(bound: BoundAnimation, names: ShapeNames) -> tuple[str, ...]:
    own = names.get(bound.prim.GetPath(), {})
    tokens = map(str, bound.animation.GetBlendShapeOrder())
    return tuple(own.get(token, token) for token in tokens)


def _is_posed(binding: BoundAnimation) -> bool:
    """Whether a SkelAnimation without samples holds joints elsewhere than at rest."""
    order = list(binding.skeleton.GetJointOrder())
    rest = binding.skeleton.ComputeJointLocalTransforms(0.0, True)
    shown = binding.skeleton.ComputeJointLocalTransforms(0.0)
    if not order or rest is None or shown is None:
        return False
    return not np.allclose(np.array(shown), np.array(rest), rtol=_POSED, atol=_POSED)


def _merged_defaults(bounds: Sequence[BoundAnimation], names: ShapeNames) -> WeightsTake | None:
    """Return the weights that all SkelAnimations have without time, if some are not zero."""
    columns: dict[str, float] = {}
    for bound in bounds:
        row = UsdSkel.Animation(bound.animation.GetPrim()).GetBlendShapeWeightsAttr().Get()
        own = _names(bound, names)
        if row is not None and len(row) == len(own):
            columns = dict(zip(own, map(float, row), strict=True)) | columns
    if not any(columns.values()):
        return None
    return WeightsTake(tuple(columns), np.zeros(1), np.array([[*columns.values()]]))


def _weights(bound: BoundAnimation, names: ShapeNames, clock: _Clock) -> WeightsTake:
    query, own = bound.animation, _names(bound, names)
    codes = np.array(query.GetBlendShapeWeightTimeSamples())
    values = UsdSkel.Animation(query.GetPrim()).GetBlendShapeWeightsAttr()
    rows = []
    for code in codes:
        given = values.Get(float(code))  # None where the sample is blocked
        row = np.asarray([] if given is None else given, np.float64)
        if row.shape != (len(own),):
            raise InputError(
                f"{bound.path} has {row.size} blendShapeWeights for {len(own)} "
                f"blendShapes at time code {code:g}",
                "WEIGHTS_LENGTH_WRONG",
            )
        rows.append(row)
    times = clock.times(codes)
    return WeightsTake(own, times, np.array(rows), clock.grid(times))


def _merged_weights(
    bounds: Sequence[BoundAnimation], names: ShapeNames, clock: _Clock
) -> tuple[WeightsTake | None, list[Finding]]:
    """Return the weights of all SkelAnimations that play at once; of equal names the first."""
    takes = [_weights(bound, names, clock) for bound in bounds]
    if len(takes) < 2:
        return (takes[0] if takes else None), []
    times = np.unique(np.concatenate([take.times for take in takes]))
    columns: dict[str, FloatArray] = {}
    found = []
    for bound, take in zip(bounds, takes, strict=True):
        for name, curve in zip(take.names, take.weights.T, strict=True):
            own = np.interp(times, take.times, curve)
            if not np.allclose(columns.setdefault(name, own), own, rtol=0, atol=_SAME_WEIGHT):
                message = "{joint!r} moves otherwise in another SkelAnimation, which comes first"
                found.append(finding("ANIMATION_DROPPED", str(bound.path), message, name))
    weights = np.stack([*columns.values()], 1)
    return WeightsTake(tuple(columns), times, weights, max(t.rate for t in takes)), found


def _side_by_side(one: WeightsTake | None, other: WeightsTake) -> WeightsTake:
    """Return takes of different names as one, with the keys of both."""
    if one is None:
        return other
    times = np.union1d(one.times, other.times)
    curves = [
        np.interp(times, take.times, curve) for take in (one, other) for curve in take.weights.T
    ]
    names = (*one.names, *other.names)
    return WeightsTake(names, times, np.stack(curves, 1), max(one.rate, other.rate))


def _joints(
    binding: BoundAnimation, staged: StagedSkeleton, si: FloatArray, clock: _Clock
) -> tuple[JointsTake | None, list[Finding]]:
    """Return the animated joints in the rig's frames (`usdface.io.usd.skeleton`)."""
    skeleton, renamed = staged.skeleton, staged.renamed
    where = str(binding.path)
    order = tuple(map(str, binding.animation.GetJointOrder()))
    known = [k for k, joint in enumerate(order) if joint in skeleton.joints]
    found = []
    if len(known) < len(order):
        message = "{joint_count} animated joints are not in the skeleton"
        found.append(finding("ANIMATION_DROPPED", where, message, len(order) - len(known)))
    codes = np.array(binding.animation.GetJointTransformTimeSamples() or [clock.start])
    xforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    world = np.array(xforms.GetLocalToWorldTransform(binding.prim), np.float64)
    moved = animated_joints(binding.animation, skeleton, world @ si, codes.tolist())
    if moved is None:
        message = "translations, rotations and scales do not fit the joints"
        return None, [*found, finding("ANIMATION_DROPPED", where, message)]
    times = clock.times(codes)
    joints = tuple(renamed[name] for name in moved.names)
    return JointsTake(joints, times, *moved[1:], clock.grid(times)), found
