"""Clips from USD: the SkelAnimations of a character, one for each variant that binds one."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.clips import Clip, JointsTake
from usdface.findings import Finding, finding
from usdface.io.usd.bound_curves import (
    ClipClock,
    joints_of,
    merged_defaults,
    merged_weights,
    shape_names_of,
    side_by_side,
)
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
from usdface.io.usd.stage import stage_name
from usdface.io.usd.vertex_cache import VertexCache, add_cache_shapes, find_vertex_caches
from usdface.rigs import Rig
from usdface.takes import WeightsTake

__all__ = ["animated_rig", "clips_of_stage"]

_POSED = 1e-5  # of a matrix: SkelAnimations hold float32, and scales of 16 bits near 1
_OWN_NAMES: ShapeNames = {}


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
    return merged_defaults(bound_animations(stage), names)


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
    animations = {(b.animation.GetPrim(), shape_names_of(b, scene.names)): b for b in playing_now}
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
    clock = ClipClock(min([start, *codes[:1]]), metrics.time_codes_per_second)
    takes = [_joint_take(motion, clock) for motion in scene.motions]
    above = prefixes(scene.skeletons, scene.motions)
    found: list[Finding] = []
    if len(codes) and clock.start not in (0.0, 1.0):
        message = "time 0 is time code {frame_number:g} of the stage"
        where = stage_name(stage)
        found.append(finding("FRAMES_RENUMBERED", where, message, clock.start))
    for bound, skeleton in jointed:
        joints, new_findings = joints_of(bound, skeleton, to_si(metrics), clock)
        found += new_findings
        if joints is not None:
            prefix = above[skeleton.path]
            takes.append(replace(joints, joints=tuple(prefix + joint for joint in joints.joints)))
    pose = merge_joint_takes(takes)
    if not len(codes):
        still = merged_defaults(list(animations.values()), scene.names)
        return (Clip("", still, pose) if still or pose else None), found
    weights, new_findings = merged_weights(weighted, scene.names, clock)
    found += new_findings
    for cache in scene.caches:
        weights = side_by_side(weights, cache.take(clock.times(cache.codes)))
    shown = [*weighted, *(bound for bound, _ in jointed), *animations.values()]
    prims = [bound.animation.GetPrim() for bound in shown]
    motions = [motion.name for motion in scene.motions]
    motions += [Sdf.Path(cache.path).name for cache in scene.caches]
    name = prims[0].GetDisplayName() or prims[0].GetName() if prims else motions[0]
    return Clip(name, weights, pose), found


def _joint_take(motion: RigidMotion, clock: ClipClock) -> JointsTake:
    moves, turns, sizes = (part[:, None] for part in continuous_parts(motion.matrices))
    times = clock.times(motion.codes)
    return JointsTake((motion.joint,), times, moves, turns, sizes, clock.grid(times))


def _is_posed(binding: BoundAnimation) -> bool:
    """Whether a SkelAnimation without samples holds joints elsewhere than at rest."""
    order = list(binding.skeleton.GetJointOrder())
    rest = binding.skeleton.ComputeJointLocalTransforms(0.0, True)
    shown = binding.skeleton.ComputeJointLocalTransforms(0.0)
    if not order or rest is None or shown is None:
        return False
    return not np.allclose(np.array(shown), np.array(rest), rtol=_POSED, atol=_POSED)
