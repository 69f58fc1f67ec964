"""A skeleton as glTF nodes and skins."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pygltflib

from usdface.arrays import FloatArray
from usdface.clips import Clip
from usdface.findings import Finding, finding
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.groups import SKELETON_ROOT
from usdface.io.gltf.quantize import Box
from usdface.io.transforms import compose, decompose
from usdface.rigs import Rig, Skeleton

__all__ = ["animated_skeleton", "write_dequantising_skins", "write_skeleton"]


def write_dequantising_skins(
    skeleton: Skeleton,
    boxed: Sequence[tuple[int, Box]],
    document: pygltflib.GLTF2,
    builder: BufferBuilder,
) -> None:
    """Give each skinned mesh that was put into a box a skin that takes it out again."""
    for node, box in boxed:
        document.nodes[node].skin = len(document.skins)
        inverse = _inverse_binds(skeleton, box.matrix)
        binds = builder.array(inverse)
        plain = document.skins[0]
        document.skins.append(replace(plain, inverseBindMatrices=binds))
    used = {n.skin for n in document.nodes if n.skin is not None}
    if boxed and 0 not in used:  # nothing uses the plain skin
        document.skins = document.skins[1:]
        for node, _ in boxed:
            document.nodes[node].skin -= 1


def _inverse_binds(skeleton: Skeleton, first: FloatArray) -> FloatArray:
    """Return from mesh to joint space (J, 16), through `first` (4, 4), column-major."""
    inverse = first @ np.linalg.inv(skeleton.bind)
    inverse[:, :, 3] = (0, 0, 0, 1)  # to the last bit, as the specification wants
    return np.asarray(inverse.reshape(-1, 16))


def animated_skeleton(rig: Rig, clips: Sequence[Clip]) -> Skeleton | None:
    """Return the rig's skeleton if it can move anything."""
    skeleton = rig.skeleton
    if skeleton is None or not any(mesh.skin is not None for mesh in rig.meshes):
        return None
    alone = len(skeleton.joints) == 1 and np.allclose(skeleton.bind, skeleton.rest, atol=1e-9)
    moved = any(clip.joints is not None for clip in clips)
    return None if alone and not moved else skeleton


def write_skeleton(
    skeleton: Skeleton, document: pygltflib.GLTF2, builder: BufferBuilder, found: list[Finding]
) -> list[int]:
    """Append a node for each joint and the skin; return the node that all hang on.

    Joints of a skin need a common root (section 3.7.3.2): several roots get a node above them.
    """
    start = len(document.nodes)
    place = {path: start + k for k, path in enumerate(skeleton.joints)}
    roots = []
    for path, name, rest in zip(skeleton.joints, skeleton.names, skeleton.rest, strict=True):
        translation, rotation, scale = decompose(rest)
        if not np.allclose(compose(translation, rotation, scale), rest, atol=1e-5):
            message = "the shear of a joint's rest transform is left out"
            found.append(finding("FEATURE_DROPPED", path, message, feature="joint_shear"))
        document.nodes.append(
            pygltflib.Node(
                name=name,
                translation=translation.tolist(),
                rotation=rotation.tolist(),
                scale=scale.tolist(),
            )
        )
        parent = place.get(path.rpartition("/")[0])
        if parent is None:
            roots.append(place[path])
        else:
            document.nodes[parent].children.append(place[path])
    document.skins = [
        pygltflib.Skin(
            name=skeleton.skin_name or None,
            joints=list(place.values()),
            inverseBindMatrices=builder.array(_inverse_binds(skeleton, np.eye(4))),
        )
    ]
    if len(roots) > 1:
        document.nodes.append(
            pygltflib.Node(name="Skeleton", children=roots, extras={"usdface": SKELETON_ROOT})
        )
        roots = [len(document.nodes) - 1]
    return roots
