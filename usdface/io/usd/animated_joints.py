"""Joints that a SkelAnimation moves, in the frames of a rig in metres."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pxr import UsdSkel

from usdface.arrays import FloatArray
from usdface.io.transforms import decompose, followed_by
from usdface.io.usd.skeleton import parent_frames
from usdface.rigs import Skeleton

__all__ = ["AnimatedJoints", "animated_joints"]

_SAME_SCALE = 1e-5  # a fiftieth of the step of 16-bit scales at 1 (2**-11)


class AnimatedJoints(NamedTuple):
    """Joints of a skeleton, by their names in it, and their transforms to their parents."""

    names: tuple[str, ...]
    translations: FloatArray
    """(F, J, 3) [m]"""
    rotations: FloatArray
    """(F, J, 4), unit quaternions x, y, z, w"""
    scales: FloatArray
    """(F, J, 3)"""


def animated_joints(
    query: UsdSkel.AnimQuery, skeleton: Skeleton, to_rig: FloatArray, codes: Sequence[float]
) -> AnimatedJoints | None:
    """Return the joints of a skeleton that a SkelAnimation names, at time codes (F).

    None if it names none of them, or its arrays do not fit its joints.

    Parameters
    ----------
    query : UsdSkel.AnimQuery
    skeleton : Skeleton
        Joints as the stage names them.
    to_rig : (4, 4) float64
        From skeleton space to that of the rig.
    codes : sequence of float
    """
    order = tuple(map(str, query.GetJointOrder()))
    known = [k for k, joint in enumerate(order) if joint in skeleton.joints]
    rows = [query.ComputeJointLocalTransformComponents(float(code)) for code in codes]
    if not known or any(row is None or any(len(p) != len(order) for p in row) for row in rows):
        return None
    moves, turns, sizes = (
        np.array([np.asarray(row[k], np.float64) for row in rows]) for k in range(3)
    )
    turns = _unit(turns)
    scale, below = parent_frames(skeleton.joints, to_rig)
    _, _, rests = decompose(skeleton.rest)
    parts = []
    for k in known:
        place = skeleton.joints.index(order[k])
        move, turn, size = followed_by(moves[:, k], turns[:, k], sizes[:, k], below[place])
        size = size / scale
        # 16 bits hold few scales: next to that at rest, the joint is at rest.
        size = np.where(np.abs(size - rests[place]) < _SAME_SCALE, rests[place], size)
        parts.append((move, turn, size))
    stacked = (np.stack(values, 1) for values in zip(*parts, strict=True))
    return AnimatedJoints(tuple(order[k] for k in known), *stacked)


def _unit(rotations: FloatArray) -> FloatArray:
    length = np.linalg.norm(rotations, axis=-1, keepdims=True)
    identity = np.array([0.0, 0.0, 0.0, 1.0])
    return np.where(length > 0, rotations / np.where(length > 0, length, 1.0), identity)
