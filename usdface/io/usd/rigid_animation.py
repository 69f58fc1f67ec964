"""Rigid motion of prims as joints, which glTF and UsdSkel move in the same way."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.io.prim_names import prim_names
from usdface.io.transforms import along
from usdface.io.usd.metrics import metrics_of, to_si
from usdface.io.usd.motion_keys import motion_keys
from usdface.io.usd.prim_walks import lineage
from usdface.io.usd.skel_bindings import skinned_by
from usdface.io.usd.skeletons import StagedSkeleton
from usdface.io.usd.world_transforms import transform_codes
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = [
    "RigidMotion",
    "add_rigid_joints",
    "find_rigid_motions",
    "merge_joint_takes",
    "prefixes",
    "transform_time_codes",
]

_SAME = 1e-9  # of a matrix: above the rounding of its doubles, below that of float32 points


@dataclass(frozen=True, eq=False, slots=True)
class RigidMotion:
    """Rigid motion of some prims, relative to the start of the stage.

    Attributes
    ----------
    name : str
        Of the lowest prim with an animated transform.
    joint : str
        Path of the joint that it becomes, at the root of the skeleton.
    paths : tuple of str
        Meshes and skeletons with this motion.
    codes : (F,) float64
        Time codes of its keys: those of the samples, and more where it goes along curves.
    matrices : (F, 4, 4) float64
        In the rig's space, for row vectors, metres.
    """

    name: str
    joint: str
    paths: tuple[str, ...]
    codes: FloatArray
    matrices: FloatArray


def transform_time_codes(prim: Usd.Prim) -> dict[Sdf.Path, list[float]]:
    """Return the time codes of the keys of the transforms of a prim and its ancestors."""
    found = {}
    for each in lineage(prim):
        xform = UsdGeom.Xformable(each)
        if xform and xform.TransformMightBeTimeVarying():
            found[each.GetPath()] = transform_codes(xform)
    return found


def find_rigid_motions(stage: Usd.Stage, rig: Rig) -> tuple[RigidMotion, ...]:
    """Return the rigid motions of the meshes without a skin, and of the skeletons, of a rig.

    A mesh with a skin moves with its skeleton. Prims with equal motion share one.
    """
    skeletons = skinned_by(stage)
    carriers = {
        mesh.path: skeletons.get(mesh.path) or stage.GetPrimAtPath(mesh.path)
        for mesh in rig.meshes
        if mesh.skin is None
    }
    with_skins = (mesh.path for mesh in rig.meshes if mesh.skin is not None)
    moving = (skeletons[path] for path in with_skins if path in skeletons)
    carriers |= {str(skeleton.GetPath()): skeleton for skeleton in moving}
    motions: list[RigidMotion] = []
    for path, prim in carriers.items():
        keys = transform_time_codes(prim)
        if not keys:
            continue
        motion = _motion_since_start(prim)
        codes = motion_keys(motion, np.unique(np.concatenate([np.array(k) for k in keys.values()])))
        matrices = np.array([motion(code) for code in codes.tolist()])
        same = [m for m in motions if _same_motion(m, codes, matrices)]
        if same:
            place = motions.index(same[0])
            motions[place] = replace(same[0], paths=(*same[0].paths, path))
        else:
            motions.append(RigidMotion(next(iter(keys)).name, "", (path,), codes, matrices))
    used_names = rig.skeleton.joints if rig.skeleton else ()
    names = prim_names((motion.name for motion in motions), (j for j in used_names if "/" not in j))
    return tuple(replace(m, joint=name) for m, name in zip(motions, names, strict=True))


def _same_motion(motion: RigidMotion, codes: FloatArray, matrices: FloatArray) -> bool:
    return np.array_equal(motion.codes, codes) and np.allclose(
        motion.matrices, matrices, rtol=0, atol=_SAME
    )


def _motion_since_start(prim: Usd.Prim) -> Callable[[float], FloatArray]:
    si = to_si(metrics_of(prim.GetStage()))

    def world(code: Usd.TimeCode) -> FloatArray:
        xform = UsdGeom.XformCache(code).GetLocalToWorldTransform(prim)
        return np.array(xform, np.float64) @ si

    start = np.linalg.inv(world(Usd.TimeCode.EarliestTime()))
    return lambda code: np.asarray(start @ world(Usd.TimeCode(code)), np.float64)


def prefixes(
    skeletons: Sequence[StagedSkeleton], motions: Sequence[RigidMotion]
) -> dict[Sdf.Path, str]:
    """Return the path of the joint, with a slash, that moves each skeleton as a whole, else ""."""
    joints = {path: f"{motion.joint}/" for motion in motions for path in motion.paths}
    return {one.path: joints.get(str(one.path), "") for one in skeletons}


def add_rigid_joints(
    rig: Rig, motions: Sequence[RigidMotion], skeletons: Sequence[StagedSkeleton]
) -> Rig:
    """Return the rig with a joint at the origin for each rigid motion."""
    if not motions:
        return rig
    old = rig.skeleton or Skeleton((), (), np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))
    above = prefixes(skeletons, motions)
    renamed = {joint: above[one.path] + joint for one in skeletons for joint in one.joints}
    still = np.tile(np.eye(4), (len(motions), 1, 1))
    skeleton = Skeleton(
        (*(m.joint for m in motions), *(renamed.get(joint, joint) for joint in old.joints)),
        (*(m.name for m in motions), *old.names),
        np.concatenate([still, old.bind]),
        np.concatenate([still, old.rest]),
        old.skin_name,
    )
    place = {path: k for k, motion in enumerate(motions) for path in motion.paths}
    meshes = tuple(_with_skin(mesh, place.get(mesh.path), len(motions)) for mesh in rig.meshes)
    return replace(rig, meshes=meshes, skeleton=skeleton)


def _with_skin(mesh: Mesh, motion: int | None, shift: int) -> Mesh:
    if mesh.skin is not None:
        return replace(mesh, skin=Skin(mesh.skin.joints + shift, mesh.skin.weights))
    if motion is None:
        return mesh
    count = len(mesh.points)
    return replace(mesh, skin=Skin(np.full((count, 1), motion), np.ones((count, 1))))


def merge_joint_takes(takes: Sequence[JointsTake]) -> JointsTake | None:
    """Return takes of different joints as one, with the keys of all."""
    if len(takes) < 2:
        return takes[0] if takes else None
    times = np.unique(np.concatenate([take.times for take in takes]))
    parts = [_resampled(take, times) for take in takes]
    moves, turns, sizes = (np.concatenate(values, 1) for values in zip(*parts, strict=True))
    joints = tuple(joint for take in takes for joint in take.joints)
    return JointsTake(joints, times, moves, turns, sizes, max(take.rate for take in takes))


def _resampled(take: JointsTake, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    place = (np.searchsorted(take.times, times, side="right") - 1).clip(0)
    follow = (place + 1).clip(max=len(take.times) - 1)
    span = take.times[follow] - take.times[place]
    part = ((times - take.times[place]) / np.where(span > 0, span, 1.0)).clip(0, 1)
    part = np.where(span > 0, part, 0.0)

    def straight(values: FloatArray) -> FloatArray:
        change = part[:, None, None] * (values[follow] - values[place])
        return np.asarray(values[place] + change, np.float64)

    turns = [along(take.rotations[:, k], place, part) for k in range(len(take.joints))]
    return straight(take.translations), np.stack(turns, 1), straight(take.scales)
