"""Animations of glTF as clips: weights of blend shapes and transforms of joints.

Source: glTF 2.0 specification, section 3.11 (animations); KHR_animation_pointer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pygltflib import Animation

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.animation_size import check_size
from usdface.io.gltf.channels import Channel, channels_of
from usdface.io.gltf.curve_tolerance import CurveTolerance, curve_tolerance
from usdface.io.gltf.document import GltfFile
from usdface.io.gltf.frame_rate import chosen_rate, frame_rate
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.read_skin import Armature
from usdface.io.gltf.read_weights import PlacedMesh, WeightsMotion, shared_weights
from usdface.io.gltf.samplers import Curve, curve_of
from usdface.io.gltf.target_names import legal_text
from usdface.io.transforms import compose, decompose, followed_by
from usdface.rigs import Mesh

__all__ = ["animated_nodes", "clips_of"]

_KINDS = {"translation": ("VEC3", 3), "rotation": ("VEC4", 4), "scale": ("VEC3", 3)}
_FASTEST = 1e6  # [Hz] of a rate that is kept; JSON has numbers that floats do not
_SHEAR = 1e-5  # of a matrix, as the certificate's limit


def animated_nodes(file: GltfFile, tree: NodeTree) -> frozenset[int]:
    """Return the nodes that an animation moves together with a joint or a mesh without a skin."""
    document = file.document
    carrying = {joint for skin in document.skins or [] for joint in skin.joints or []}
    carrying |= {
        n
        for n in tree.scene
        if document.nodes[n].mesh is not None and document.nodes[n].skin is None
    }
    for node in reversed(tree.order):  # children before parents
        if node in carrying and tree.parents[node] >= 0:
            carrying.add(tree.parents[node])
    moved = {
        channel.node
        for animation in document.animations or []
        for channel in channels_of(document, file.node_weights, animation)[0]
        if channel.path != "weights"
    }
    return frozenset(moved & carrying)


@dataclass(frozen=True, eq=False, slots=True)
class _Motion:
    """One animation, taken apart: curves of weights by mesh, of transforms by node and path.

    `inserted` and `rate` are those of `WeightsMotion`.
    """

    name: str
    weights: dict[int, Curve]
    transforms: dict[int, dict[str, Curve]]
    inserted: FloatArray = field(repr=False)
    rate: float


def clips_of(
    file: GltfFile,
    meshes: Sequence[PlacedMesh],
    tree: NodeTree,
    armature: Armature,
    reader: AccessorReader,
) -> tuple[tuple[Mesh, ...], tuple[Clip, ...], list[Finding]]:
    """Return every animation as a clip over the blend shapes of all meshes and the joints.

    See `usdface.io.gltf.read_weights` for names of shapes and for keys, `curve_of` for
    interpolations. Weights without animation that are not zero become a clip without a name,
    the last.

    Returns
    -------
    tuple of Mesh
        The meshes, some shapes renamed.
    tuple of Clip
        In the order of the file, then the one without a name.
    list of Finding

    Raises
    ------
    InputError
        If an animation's targets, times, interpolation or number of values are not as they
        must be.
    """
    found: list[Finding] = []
    motions = []
    check_size(
        sum(
            reader.count(sampler.output)
            for animation in file.document.animations or []
            for sampler in animation.samplers or []
        ),
        "the animation of the file",
    )
    points = [placed.mesh.points for placed in meshes]
    tolerance = curve_tolerance(points, tree, [*armature.nodes])
    for number, animation in enumerate(file.document.animations or []):
        motion, new_findings = _motion(file, animation, number, meshes, armature, reader, tolerance)
        found += new_findings
        if motion.weights or motion.transforms:
            motions.append(motion)
        else:
            message = "it moves nothing that is kept" if animation.channels else "it is empty"
            count = len(animation.channels)
            found.append(finding("ANIMATION_DROPPED", motion.name, message, channel_count=count))
    parts = [WeightsMotion(m.weights, m.inserted, m.rate) for m in motions]
    if not parts or any(placed.weights.any() for placed in meshes):
        parts.append(WeightsMotion({}, np.zeros(0)))
    whole, takes, new_findings = shared_weights(meshes, parts)
    found += new_findings
    clips = []
    for motion, weights in zip(motions, takes, strict=False):
        joints, new_findings = _joints(motion, tree, armature)
        found += new_findings
        clips.append(Clip(motion.name, weights, joints))
    if len(takes) > len(motions) and takes[-1] is not None:
        clips.append(Clip("", takes[-1]))
    return whole, tuple(clips), found


def _motion(
    file: GltfFile,
    animation: Animation,
    number: int,
    meshes: Sequence[PlacedMesh],
    armature: Armature,
    reader: AccessorReader,
    tolerance: CurveTolerance,
) -> tuple[_Motion, list[Finding]]:
    name = legal_text(animation.name or f"animation {number}")
    channels, unknown = channels_of(file.document, file.node_weights, animation)
    place_of = {m.node: place for place, m in enumerate(meshes) if m.mesh.shapes}
    found: list[Finding] = []
    lost = [*unknown]
    transforms: dict[int, dict[str, Curve]] = {}
    weights: dict[int, list[tuple[int | None, Curve]]] = {}
    # A pointer overrides the core's channel, which is then its fallback.
    for channel in sorted(channels, key=lambda c: c.pointer):
        node = channel.node
        if channel.path != "weights" and node in armature.nodes:
            kind, width = _KINDS[channel.path]
            subject = f"{name!r}, node {node}"
            curve, new_findings = curve_of(
                channel.sampler, kind, width, reader, subject, tolerance.of(channel.path, node)
            )
            transforms.setdefault(node, {})[channel.path] = curve
        elif channel.path == "weights" and node in place_of:
            place = place_of[node]
            curve, new_findings = _weights_curve(channel, meshes[place], name, reader, tolerance)
            weights.setdefault(place, []).append((channel.column, curve))
        else:
            lost.append(f"{channel.path} of node {node}")
            continue
        found += new_findings
    if lost and (transforms or weights):
        message = "channels that move nothing that is kept were left out: {channels}"
        found.append(finding("ANIMATION_DROPPED", name, message, lost))
    curves = {place: _joined(parts, meshes[place].weights) for place, parts in weights.items()}
    inserted, rate = _inserted(animation, curves), _stated_rate(animation)
    return _Motion(name, curves, transforms, inserted, rate), found


def _weights_curve(
    channel: Channel,
    placed: PlacedMesh,
    name: str,
    reader: AccessorReader,
    tolerance: CurveTolerance,
) -> tuple[Curve, list[Finding]]:
    shapes = len(placed.mesh.shapes)
    subject = f"{name!r} on mesh {placed.mesh.name!r}"
    if channel.column is not None and channel.column >= shapes:
        raise InputError(f"{subject} moves weight {channel.column}, but there are {shapes}")
    width = shapes if channel.column is None else 1
    return curve_of(channel.sampler, "SCALAR", width, reader, subject, tolerance.weights)


def _joined(parts: Sequence[tuple[int | None, Curve]], rest: FloatArray) -> Curve:
    """Return the curves of single weights, or of all, over each other as one."""
    if len(parts) == 1 and parts[0][0] is None:
        return parts[0][1]
    times = np.unique(np.concatenate([curve.times for _, curve in parts]))
    keys = np.unique(np.concatenate([curve.keys for _, curve in parts]))
    values = np.tile(rest, (len(times), 1))
    for column, curve in parts:
        if column is None:
            values[:] = curve.at(times)
        else:
            values[:, column] = curve.at(times)[:, 0]
    return Curve(times, values, keys)


def _inserted(animation: Animation, curves: Mapping[int, Curve]) -> FloatArray:
    """Return the times [s] of keys that were inserted where weights pass inbetweens."""
    keys = _kept(animation).get("insertedKeys")
    if not isinstance(keys, list) or not all(type(key) is int for key in keys):
        return np.zeros(0)
    inserted = [c.times[[k for k in keys if 0 <= k < len(c.times)]] for c in curves.values()]
    return np.concatenate([np.zeros(0), *inserted])


def _stated_rate(animation: Animation) -> float:
    """Return the frame rate [Hz] of the scene that was exported, 0 where it is not kept."""
    rate = _kept(animation).get("framesPerSecond")
    if isinstance(rate, bool) or not isinstance(rate, int | float):
        return 0.0
    return float(rate) if 0.0 < rate < _FASTEST else 0.0


def _kept(animation: Animation) -> Mapping[str, Any]:
    """Return the metadata that an export of usdface left in the extras."""
    ours = animation.extras.get("usdface") if isinstance(animation.extras, Mapping) else None
    return ours if isinstance(ours, Mapping) else {}


def _joints(
    motion: _Motion, tree: NodeTree, armature: Armature
) -> tuple[JointsTake | None, list[Finding]]:
    """Return the joints that a motion moves, each relative to its parent joint."""
    if not motion.transforms or armature.skeleton is None:
        return None, []
    curves = [c for paths in motion.transforms.values() for c in paths.values()]
    times = np.unique(np.concatenate([curve.times for curve in curves]))
    check_size(10 * len(times) * len(motion.transforms), f"{motion.name!r}")
    found: list[Finding] = []
    nodes = sorted(motion.transforms, key=lambda node: armature.nodes[node])
    parts = []
    for node in nodes:
        moving = motion.transforms[node]
        move, turn, size = (
            moving[path].at(times) if path in moving else np.tile(rest, (len(times), 1))
            for path, rest in zip(_KINDS, decompose(tree.locals[node]), strict=True)
        )
        then = armature.to_parent(node, tree)
        joint, wanted = followed_by(move, turn, size, then), compose(move, turn, size) @ then
        if not np.allclose(compose(*joint), wanted, rtol=_SHEAR, atol=_SHEAR):
            message = "{animation!r}: the shear of a joint is left out"
            found.append(
                finding("FEATURE_DROPPED", str(node), message, motion.name, feature="joint_shear")
            )
        parts.append(joint)
    joints = tuple(armature.skeleton.joints[armature.nodes[node]] for node in nodes)
    moves, turns, sizes = (np.stack(values, 1) for values in zip(*parts, strict=True))
    keys = np.unique(np.concatenate([curve.keys for curve in curves]))
    rate = chosen_rate(frame_rate(keys), motion.rate)
    return JointsTake(joints, times, moves, turns, sizes, rate), found
