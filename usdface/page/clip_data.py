"""Clips of a page: weights and joints at whole frames."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from usdface.arrays import FloatArray, IntArray
from usdface.clips import Clip, JointsTake
from usdface.page.packed_data import Quantized
from usdface.rigs import Skeleton
from usdface.takes import WeightsTake

__all__ = ["TICKS_PER_SECOND", "clip_data", "joint_motion", "sampled_weights", "ticks"]

TICKS_PER_SECOND = 100_000

# A clip with fewer keys a second is shown at this rate: that of screens.
_LEAST_RATE, _SCREEN = 20.0, 60.0
# Frames of a clip: over two hours at 60 a second.
_MOST = 500_000
_ROUNDING = 1e-3  # of a frame


def clip_data(
    clip: Clip, shapes: tuple[str, ...], skeleton: Skeleton | None
) -> tuple[dict[str, Any], bool]:
    """Return a clip at whole frames, and whether it was cut to the longest that a page plays.

    Parameters
    ----------
    clip : Clip
    shapes : tuple of str
        Blend shapes of the page, in its order.
    skeleton : Skeleton or None
    """
    keys = clip.times
    rate = clip.rate if clip.rate >= _LEAST_RATE else _SCREEN
    span = float(keys[-1] - keys[0]) if len(keys) else 0.0
    # Times of files are rounded: the last key is a frame of its own.
    whole = span * rate + _ROUNDING
    frames = int(min(np.floor(whole), _MOST - 1)) + 1
    times = (float(keys[0]) if len(keys) else 0.0) + np.arange(frames) / rate
    data = {
        "name": clip.name or "as authored",
        "rate": rate,
        "ticks": ticks(times),
        "weights": {"corrected": Quantized(sampled_weights(clip.weights, shapes, times))},
        "joints": joint_motion(clip.joints, skeleton, times),
    }
    return data, whole >= _MOST


def ticks(times: FloatArray) -> IntArray:
    """Return times [s] since the first one in hundred-thousandths of a second: (F,).

    Whole numbers keep the frames of a long take apart.
    """
    return np.asarray(np.rint((times - times[0]) * TICKS_PER_SECOND), np.int64)


def sampled_weights(
    take: WeightsTake | None, shapes: tuple[str, ...], times: FloatArray
) -> FloatArray:
    """Return the weights of blend shapes at some times: (F, S); 0 where there are none."""
    weights = np.zeros((len(times), len(shapes)))
    columns = {name: i for i, name in enumerate(take.names)} if take else {}
    for column, name in enumerate(shapes):
        if take is not None and name in columns:
            weights[:, column] = np.interp(times, take.times, take.weights[:, columns[name]])
    return weights


def joint_motion(
    joints: JointsTake | None, skeleton: Skeleton | None, times: FloatArray
) -> dict[str, Any] | None:
    """Return the motion of the joints that move, at some times; None if none does.

    Each joint has its translation, its rotation (unit quaternion x, y, z, w) and its scale.
    """
    if joints is None or skeleton is None:
        return None
    known = [i for i, joint in enumerate(joints.joints) if joint in skeleton.joints]
    inside = times.clip(joints.times[0], joints.times[-1])
    moves, turns, sizes = [], [], []
    for i in known:
        moves.append(_straight(joints.translations[:, i], joints.times, inside))
        sizes.append(_straight(joints.scales[:, i], joints.times, inside))
        turns.append(_turned(joints.rotations[:, i], joints.times, inside))
    if not known:
        return None
    return {
        "joints": [skeleton.joints.index(joints.joints[i]) for i in known],
        "translations": Quantized(np.stack(moves, 1)),
        "rotations": Quantized(np.stack(turns, 1)),
        "scales": Quantized(np.stack(sizes, 1)),
    }


def _straight(values: FloatArray, keys: FloatArray, times: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, keys, column) for column in values.T], 1)


def _turned(values: FloatArray, keys: FloatArray, times: FloatArray) -> FloatArray:
    turns = Rotation.from_quat(values)
    found = Slerp(keys, turns)(times).as_quat() if len(keys) > 1 else turns.as_quat()
    found = np.broadcast_to(found, (len(times), 4)).copy()
    # q and -q are one rotation; neighbours of one sign compress well.
    signs = np.where((found[1:] * found[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    found[1:] *= np.cumprod(signs)[:, None]
    return found
