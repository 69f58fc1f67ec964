"""Bounds of a character over all blend shape weights and clips."""

import itertools
from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.inbetween_path import inbetween_path
from usdface.clips import Clip, JointsTake
from usdface.io.joint_poses import skinning_transforms
from usdface.rigs import Mesh, Skeleton, Skin

__all__ = ["posed_bounds"]


def posed_bounds(mesh: Mesh, skeleton: Skeleton | None, clips: Sequence[Clip]) -> FloatArray:
    """Return a box (2, 3) around the mesh for all weights in [0, 1], and in all of `clips`."""
    if not len(mesh.points):
        return np.zeros((2, 3))
    box = np.array([mesh.points, mesh.points])
    takes = [clip.weights for clip in clips if clip.weights is not None]
    for shape in mesh.shapes:
        columns = [take.column(shape.name) for take in takes if shape.name in take.names]
        low = min(0.0, *(column.min() for column in columns), 0.0)
        high = max(1.0, *(column.max() for column in columns), 1.0)
        knots = inbetween_path(shape).knots_between(float(low), float(high))
        reached = knots.reshape(len(knots), *shape.offsets.shape)
        box[0, shape.indices] += reached.min(axis=0)
        box[1, shape.indices] += reached.max(axis=0)
    if skeleton is None or mesh.skin is None:
        return np.array([box[0].min(axis=0), box[1].max(axis=0)])
    (moves,) = skinning_transforms(skeleton)
    corners = [
        _skinned(
            np.stack([box[side, :, axis] for axis, side in enumerate(sides)], 1), mesh.skin, moves
        )
        for sides in itertools.product((0, 1), repeat=3)
    ]
    boxes = [np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))]
    for clip in clips:
        if clip.joints is not None:
            boxes += _moving_box(box, mesh.skin, skeleton, clip.joints)
    return np.array([np.min(boxes, axis=0), np.max(boxes, axis=0)])


def _moving_box(
    box: FloatArray, skin: Skin, skeleton: Skeleton, take: JointsTake
) -> list[FloatArray]:
    """Return the corners of a box around all frames.

    A skinned point lies between the places to which its joints would bring it, so the boxes
    around the points of each joint, moved with it, hold them all.
    """
    moves = skinning_transforms(skeleton, take)
    result = []
    for joint in np.unique(skin.joints[skin.weights > 0]).tolist():
        held = ((skin.joints == joint) & (skin.weights > 0)).any(axis=1)
        low, high = box[0, held].min(axis=0), box[1, held].max(axis=0)
        corners = np.array(list(itertools.product(*zip(low, high, strict=True), (1.0,))))
        corners = corners @ moves[:, joint]
        result += [corners[..., :3].min(axis=(0, 1)), corners[..., :3].max(axis=(0, 1))]
    return result


def _skinned(points: FloatArray, skin: Skin, moves: FloatArray) -> FloatArray:
    full = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    result = np.zeros((len(points), 3))
    for joints, weights in zip(skin.joints.T, skin.weights.T, strict=True):
        result += weights[:, None] * np.einsum("vi,vij->vj", full, moves[joints])[:, :3]
    return result
