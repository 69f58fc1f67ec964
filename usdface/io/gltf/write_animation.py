"""Clips as animations of glTF.

Source: glTF 2.0 specification, section 3.11 (animations).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pygltflib

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.findings import Finding, finding
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.channels import POINTER, pointer_to
from usdface.io.gltf.frame_rate import chosen_rate, frame_rate
from usdface.io.gltf.inbetweens import crossings, flat_weights
from usdface.rigs import Mesh
from usdface.takes import WeightsTake

__all__ = ["write_animation"]

_SAME = 1e-7  # of a component of a transform: less than float32 tells of 1
_PATHS = (pygltflib.TRANSLATION, pygltflib.ROTATION, pygltflib.SCALE)


def write_animation(
    clip: Clip,
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, tuple[int, pygltflib.Node]],
    builder: BufferBuilder,
    pointer: bool,
) -> tuple[pygltflib.Animation | None, list[Finding]]:
    """Append a clip's accessors to `builder` and return the animation.

    A channel for each mesh whose weights move, all on the same times, with keys inserted where a
    weight passes an inbetween (`usdface.io.gltf.inbetweens`); and one for each translation,
    rotation and scale of a joint that differs from its rest. All are LINEAR. Extras hold the
    clip's rate where its keys do not show it.

    Parameters
    ----------
    clip : Clip
        Times below 0 are moved to start at 0; keys closer than float32 resolves are one unit in
        the last place apart.
    carriers : sequence of (int, Mesh)
        Node index of each mesh.
    joints : mapping of str to (int, Node)
        Index and node of each joint, by its path.
    builder : BufferBuilder
    pointer : bool
        Also give each weight a channel of its own, with the keys at which it changes, by
        KHR_animation_pointer. The core's channels stay, for programs without the extension.

    Returns
    -------
    Animation or None
        None where nothing moves.
    list of Finding
    """
    animation = pygltflib.Animation(name=clip.name or "weights")
    shift = max(0.0, -float(clip.times.min(initial=0.0)))
    found: list[Finding] = []
    shown = 0.0
    if clip.weights is not None:
        take = replace(clip.weights, times=_times(clip.weights.times + shift))
        shown = frame_rate(take.times)
        found += _write_weights(take, carriers, animation, builder, pointer)
    if clip.joints is not None:
        moved = replace(clip.joints, times=_times(clip.joints.times + shift))
        shown = max(shown, frame_rate(moved.times))
        found += _write_joints(moved, joints, animation, builder)
    if not animation.channels:
        return None, found
    if chosen_rate(shown, clip.rate) != shown:
        _keep(animation, framesPerSecond=clip.rate)
    if shift:
        message = "glTF has no times below 0; all are {shift_s:g} s later"
        found.append(
            finding("FEATURE_DROPPED", animation.name, message, shift, feature="negative_times")
        )
    return animation, found


def _write_weights(
    keys: WeightsTake,
    carriers: Sequence[tuple[int, Mesh]],
    animation: pygltflib.Animation,
    builder: BufferBuilder,
    pointer: bool,
) -> list[Finding]:
    known = {name for _, mesh in carriers for name in mesh.shape_names}
    found = [
        finding("SHAPE_UNKNOWN", name, "no mesh has it; its curve is left out")
        for name in keys.names
        if name not in known
    ]
    moved = [(n, m) for n, m in carriers if not set(keys.names).isdisjoint(m.shape_names)]
    if not moved:
        return found
    times = keys.times
    passed = [crossings(m, times, keys.reordered(m.shape_names).weights) for _, m in moved]
    moments = np.unique(np.concatenate([times, *passed]).astype(np.float32)).astype(np.float64)
    clock = builder.array(moments[:, None], bounds=True)
    inserted = np.flatnonzero(~np.isin(moments, times))
    if len(inserted):
        _keep(animation, insertedKeys=inserted.tolist())
    for node, mesh in moved:
        own = keys.reordered(mesh.shape_names).weights
        values = flat_weights(mesh, _at(moments, times, own))
        _add_channel(
            animation, _core(node, pygltflib.WEIGHTS), clock, builder.array(values.reshape(-1, 1))
        )
        if pointer:
            _write_single(node, moments, values, animation, builder)
    return found


def _write_single(
    node: int,
    moments: FloatArray,
    values: FloatArray,
    animation: pygltflib.Animation,
    builder: BufferBuilder,
) -> None:
    clocks: dict[bytes, int] = {}
    for column, curve in enumerate(values.astype(np.float32).T):
        changed = np.diff(curve) != 0
        kept = np.append(True, changed) | np.append(
            changed, False
        )  # both ends of a constant stretch
        own = moments[kept]
        key = own.tobytes()
        if key not in clocks:
            clocks[key] = builder.array(own[:, None], bounds=True)
        target = pygltflib.AnimationChannelTarget(
            path="pointer", extensions={POINTER: {"pointer": pointer_to(node, column)}}
        )
        output = builder.array(curve[kept][:, None])
        _add_channel(animation, target, clocks[key], output)


def _write_joints(
    take: JointsTake,
    joints: Mapping[str, tuple[int, pygltflib.Node]],
    animation: pygltflib.Animation,
    builder: BufferBuilder,
) -> list[Finding]:
    found: list[Finding] = []
    all_keys: int | None = None
    one_key: int | None = None
    last = max((k for k, path in enumerate(take.joints) if path in joints), default=-1)
    for place, path in enumerate(take.joints):
        if path not in joints:
            message = "moves a joint that the skeleton lacks"
            found.append(finding("ANIMATION_DROPPED", path, message))
            continue
        index, node = joints[path]
        parts = take.translations, take.rotations, take.scales
        rests = node.translation, node.rotation, node.scale
        for kind, values, rest in zip(_PATHS, parts, rests, strict=True):
            curve = values[:, place]
            if kind == pygltflib.ROTATION:
                curve = _continuous(curve)
            still = np.abs(curve - curve[0]).max() <= _SAME * max(1.0, np.abs(curve).max())
            at_rest = still and np.abs(curve[0] - rest).max() <= _SAME * max(
                1.0, np.abs(rest).max()
            )
            # A clip in which nothing leaves its rest is a clip, too.
            if at_rest and (animation.channels or (place, kind) != (last, _PATHS[-1])):
                continue
            if still:
                if one_key is None:
                    one_key = builder.array(take.times[:1, None], bounds=True)
                clock, curve = one_key, curve[:1]
            else:
                if all_keys is None:
                    all_keys = builder.array(take.times[:, None], bounds=True)
                clock = all_keys
            _add_channel(animation, _core(index, kind), clock, builder.array(curve))
    return found


def _keep(animation: pygltflib.Animation, **ours: Any) -> None:
    """Add metadata for `usdface import` to the extras."""
    animation.extras = {"usdface": (animation.extras or {}).get("usdface", {}) | ours}


def _continuous(rotations: FloatArray) -> FloatArray:
    """Return quaternions (F, 4) of which none is on the far side of the one before."""
    turned = np.einsum("fk,fk->f", rotations[1:], rotations[:-1]) < 0
    sign = np.cumprod(np.where(turned, -1.0, 1.0))
    return np.concatenate([rotations[:1], rotations[1:] * sign[:, None]])


def _core(node: int, path: str) -> pygltflib.AnimationChannelTarget:
    return pygltflib.AnimationChannelTarget(node=node, path=path)


def _add_channel(
    animation: pygltflib.Animation,
    target: pygltflib.AnimationChannelTarget,
    clock: int,
    values: int,
) -> None:
    animation.channels.append(
        pygltflib.AnimationChannel(sampler=len(animation.samplers), target=target)
    )
    animation.samplers.append(pygltflib.AnimationSampler(input=clock, output=values))


def _at(moments: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    if len(moments) == len(times):
        return values
    return np.stack([np.interp(moments, times, column) for column in values.T], 1)


def _times(times: FloatArray) -> FloatArray:
    """Return times, 0 or later, that stay distinct as float32; of a jump the later key stays."""
    single = times.astype(np.float32) + np.float32(0)
    # The bit patterns of non-negative floats count upwards like the floats.
    steps = np.arange(len(single))
    bits = single.view(np.int32).astype(np.int64) - steps
    bits = np.minimum.accumulate(bits[::-1])[::-1].clip(min=0)
    bits = np.maximum.accumulate(bits) + steps
    return bits.astype(np.int32).view(np.float32).astype(np.float64)
