"""Clips of one file for the rig of another: joints and blend shapes are matched by name."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.read_clips import read_clips
from usdface.io.transforms import decompose
from usdface.io.usd.joint_frames import with_unit_scales
from usdface.rigs import Rig, Skeleton
from usdface.takes import WeightsTake

__all__ = ["rig_with_clips"]

_NEAR, _TURNED = 1e-4, 1e-3  # [m], of a quaternion: rest poses that differ by less are equal


def rig_with_clips(
    path: Path, rig: Rig, own: tuple[Clip, ...], asset_root: Path | None
) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    """Return a rig with the clips of a glTF, before those that it has.

    A joint's transform relative to its parent is taken as it is.

    Parameters
    ----------
    path : Path
        .glb or .gltf, with or without meshes.
    rig : Rig
    own : tuple of Clip
        The rig's.
    asset_root : Path, optional
        A folder that buffers may come from beside that of the file.

    Returns
    -------
    Rig
        With the units of joints that USD can hold, in which the clips are.
    tuple of Clip
    list of Finding
        SHAPE_UNKNOWN and ANIMATION_DROPPED for blend shapes and joints that the rig lacks;
        FEATURE_APPROXIMATED where joints stand otherwise, or hang on others.

    Raises
    ------
    InputError
        If the file cannot be read, or moves nothing of the rig.
    """
    source, found = read_clips(path, rig, asset_root)
    skeleton, clips = source.skeleton, source.clips
    if skeleton is not None:
        skeleton, clips, _ = with_unit_scales(skeleton, clips)
    if rig.skeleton is not None:
        held, own, _ = with_unit_scales(rig.skeleton, own)
        rig = replace(rig, skeleton=held)
    joints = _matched_joints(skeleton, rig.skeleton)
    new_findings = _report_joints(path, clips, joints, skeleton, rig.skeleton)
    found += new_findings
    named = dict.fromkeys(n for c in clips if c.weights for n in c.weights.names)
    shapes = _matched_shapes(named, rig)
    message = "the clips name a blend shape that the rig lacks"
    lacking = [name for name in named if name not in shapes.values()]
    found += [finding("SHAPE_UNKNOWN", name, message) for name in lacking]
    matched = [_matched(clip, shapes, joints) for clip in clips]
    moving = [clip for clip in matched if clip.weights or clip.joints]
    if not moving:
        raise InputError(
            f"{path}: none of its animations moves a blend shape or joint of the rig; they move "
            + ", ".join([*named, *(skeleton.names if skeleton else ())][:8])
        )
    return rig, tuple(_named_apart([*moving, *own])), found


def _matched_shapes(named: Collection[str], rig: Rig) -> dict[str, str]:
    """Return the source's blend shape for each of the rig's: of the same name, else of its label.

    The label is the name before it was made unique. Several meshes may have one, and move alike.
    """
    matched = {name: name for name in rig.shape_names if name in named}
    for mesh in rig.meshes:
        for shape in mesh.shapes:
            if shape.label in named and shape.label not in mesh.shape_names:
                matched.setdefault(shape.name, shape.label)
    return matched


def _matched_joints(source: Skeleton | None, rig: Skeleton | None) -> dict[str, str]:
    """Return the rig's joint for each of the source's: of the same path, else of the same name."""
    if source is None or rig is None:
        return {}
    by_name: dict[str, str] = {}
    for joint, name in zip(rig.joints, rig.names, strict=True):
        by_name.setdefault(name, joint)
    taken: set[str] = set()
    matched = {}
    for joint, name in zip(source.joints, source.names, strict=True):
        found = joint if joint in rig.joints else by_name.get(name)
        if found is not None and found not in taken:
            taken.add(found)
            matched[joint] = found
    return matched


def _report_joints(
    path: Path,
    clips: tuple[Clip, ...],
    matched: dict[str, str],
    source: Skeleton | None,
    rig: Skeleton | None,
) -> list[Finding]:
    moved = dict.fromkeys(j for c in clips if c.joints for j in c.joints.joints)
    found = []
    lost = [joint for joint in moved if joint not in matched]
    if lost:
        message = "nodes that the rig has no joint for were left out: {channels}"
        found.append(finding("ANIMATION_DROPPED", path.name, message, lost))
    if source is None or rig is None or not matched:
        return found
    own = np.array([source.joints.index(joint) for joint in matched])
    other = np.array([rig.joints.index(joint) for joint in matched.values()])
    here, there = decompose(source.rest[own]), decompose(rig.rest[other])
    apart = np.linalg.norm(here[0] - there[0], axis=1)
    turned = 1 - np.abs((here[1] * there[1]).sum(axis=1))
    if apart.max() > _NEAR or turned.max() > _TURNED:
        message = (
            "joints stand otherwise at rest than the rig's, by up to {error_mm:.3g} mm and "
            "{angle_degrees:.3g} degrees; their transforms are taken as they are"
        )
        angle = 2 * np.degrees(np.arccos(1 - turned.max().clip(0, 1)))
        values = 1e3 * apart.max(), angle
        found.append(
            finding("FEATURE_APPROXIMATED", path.name, message, *values, feature="rest_pose")
        )
    elsewhere = [
        joint
        for joint, same in matched.items()
        if joint in moved and matched.get(_parent(joint), "") != _parent(same)
    ]
    if elsewhere:
        message = "joints that hang on another joint in the rig: {names}"
        found.append(
            finding("FEATURE_APPROXIMATED", path.name, message, elsewhere, feature="joint_parents")
        )
    return found


def _parent(joint: str) -> str:
    return joint.rpartition("/")[0]


def _matched(clip: Clip, shapes: dict[str, str], joints: dict[str, str]) -> Clip:
    weights, moving = clip.weights, clip.joints
    if weights is not None:
        place = {name: k for k, name in enumerate(weights.names)}
        kept = {own: place[name] for own, name in shapes.items() if name in place}
        columns = weights.weights[:, list(kept.values())]
        weights = WeightsTake(tuple(kept), weights.times, columns, weights.rate) if kept else None
    if moving is not None:
        own = [k for k, joint in enumerate(moving.joints) if joint in joints]
        paths = tuple(joints[moving.joints[k]] for k in own)
        moves, turns, sizes = (
            part[:, own] for part in (moving.translations, moving.rotations, moving.scales)
        )
        rate = moving.rate
        moving = JointsTake(paths, moving.times, moves, turns, sizes, rate) if own else None
    return Clip(clip.name, weights, moving)


def _named_apart(clips: list[Clip]) -> list[Clip]:
    """Give later clips of a name another one."""
    taken: set[str] = set()
    result = []
    for clip in clips:
        name, number = clip.name, 1
        while name in taken and name:
            number += 1
            name = f"{clip.name} {number}"
        taken.add(name)
        result.append(replace(clip, name=name))
    return result
