"""The animations of a glTF alone, for a rig that is given: its meshes, if any, do not count."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pygltflib import Mesh as GltfMesh

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.channels import Channel, channels_of
from usdface.io.gltf.decompress import decompress
from usdface.io.gltf.document import GltfFile, load_document
from usdface.io.gltf.errors import schema_errors
from usdface.io.gltf.inbetweens import flat_mesh, steps_in
from usdface.io.gltf.nodes import node_tree
from usdface.io.gltf.read_animation import clips_of
from usdface.io.gltf.read_skin import armature_of
from usdface.io.gltf.read_weights import PlacedMesh
from usdface.io.gltf.target_names import legal_text, target_names
from usdface.rigs import BlendShape, Mesh, Rig, Skeleton

__all__ = ["SourceClips", "read_clips"]


@dataclass(frozen=True, eq=False, slots=True)
class SourceClips:
    """Clips over the blend shapes that a file names, and the skeleton of the nodes they move."""

    clips: tuple[Clip, ...]
    skeleton: Skeleton | None


def read_clips(path: Path, rig: Rig, asset_root: Path | None) -> tuple[SourceClips, list[Finding]]:
    """Read the animations of a .glb or .gltf that need not have a mesh.

    Morph targets have the names in ``extras.targetNames`` of their mesh or node; without these
    they are those of the rig's mesh of the node's name, in order, if they are as many. Nodes that
    are animated, or have the name of a joint of the rig, become joints.

    Raises
    ------
    InputError
        If the file cannot be read or has no animation.
    """
    with schema_errors(path):
        return _read(decompress(load_document(path, asset_root)), rig)


def _read(file: GltfFile, rig: Rig) -> tuple[SourceClips, list[Finding]]:
    document, reader = file.document, AccessorReader(file)
    if not document.animations:
        raise InputError("the file has no animation", "TAKE_EMPTY")
    tree = node_tree(document)
    channels = [
        channel
        for animation in document.animations
        for channel in channels_of(document, file.node_weights, animation)[0]
    ]
    known = set(rig.skeleton.names) if rig.skeleton else set()
    moved = {channel.node for channel in channels if channel.path != "weights"}
    named = {k for k, node in enumerate(document.nodes) if node.name in known}
    armature, found = armature_of(document, tree, reader, moved | named)
    meshes = []
    for node in sorted({channel.node for channel in channels if channel.path == "weights"}):
        own = [c for c in channels if c.node == node and c.path == "weights"]
        width = max(_width(channel, reader) for channel in own)
        meshes.append(_carrier(file, node, width, rig, found))
    _, clips, new_findings = clips_of(file, meshes, tree, armature, reader)
    moving = tuple(clip for clip in clips if not clip.still)
    return SourceClips(moving, armature.skeleton), found + new_findings


def _width(channel: Channel, reader: AccessorReader) -> int:
    """Return how many morph targets a channel of weights knows of."""
    if channel.column is not None:
        return channel.column + 1
    sampler = channel.sampler
    each = 3 if sampler.interpolation == "CUBICSPLINE" else 1
    return reader.count(sampler.output) // (each * reader.count(sampler.input))


def _carrier(file: GltfFile, node: int, width: int, rig: Rig, found: list[Finding]) -> PlacedMesh:
    """Return a mesh without points that has the morph targets of a node."""
    document, source = file.document, file.document.nodes[node]
    name = legal_text(source.name or f"node {node}")
    holder = GltfMesh(primitives=[], extras=source.extras)
    if source.mesh is not None:
        holder = document.meshes[source.mesh]
    names, _, _ = target_names(holder, name, source.extras, document.accessors or ())
    extras = holder.extras
    if not names:
        names, extras = _names_in_order(rig, name, width)
        if names:
            message = "its morph targets have no names: they are taken in the order of the rig's"
            found.append(finding("FEATURE_APPROXIMATED", name, message, feature="target_order"))
        else:
            names = tuple(f"target_{k}" for k in range(width))
    none, nowhere = np.zeros(0, np.int64), np.zeros((0, 3))
    shapes = tuple(BlendShape(n, none, nowhere) for n in names)
    mesh = Mesh(name, nowhere, none, none, shapes=shapes)
    steps = steps_in(extras, names) or ()
    return PlacedMesh(mesh, node, np.zeros(len(names)), steps)


def _names_in_order(
    rig: Rig, name: str, width: int
) -> tuple[tuple[str, ...], Mapping[str, object]]:
    """Return the targets that the rig's mesh of a name has in glTF, if they are `width`."""
    with_shapes = [mesh for mesh in rig.meshes if mesh.shapes]
    same = [mesh for mesh in with_shapes if mesh.name == name]
    for mesh in same or (with_shapes if len(with_shapes) == 1 else []):
        flat, notes, _ = flat_mesh(mesh)
        for names, ours in ((flat.shape_names, notes), (mesh.shape_names, [])):
            if len(names) == width:
                return names, {"usdface": {"inbetweens": ours}}
    return (), {}
