"""A rig and its clips to glTF 2.0."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType

import pygltflib

from usdface.clips import Clip
from usdface.findings import Finding, finding
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.channels import POINTER
from usdface.io.gltf.document import save_document
from usdface.io.gltf.extras import extras_with_metadata
from usdface.io.gltf.groups import write_groups
from usdface.io.gltf.hard_edges import split_hard_edges
from usdface.io.gltf.inbetweens import flat_weights
from usdface.io.gltf.limit_influences import limit_influences
from usdface.io.gltf.quantize import Box, bounding_box
from usdface.io.gltf.scene import write_scene
from usdface.io.gltf.textures import TextureBuilder, uv_name_extras
from usdface.io.gltf.variants import write_variants
from usdface.io.gltf.vertex_colours import (
    default_material,
    has_faces_without_material,
    white_base_colors,
)
from usdface.io.gltf.vertex_split import uv_order
from usdface.io.gltf.vrm import VRM, vrm_extension
from usdface.io.gltf.vrm_nodes import NamedNodes, mesh_numbers, write_vrm_nodes
from usdface.io.gltf.write_animation import write_animation
from usdface.io.gltf.write_materials import write_materials
from usdface.io.gltf.write_mesh import write_mesh
from usdface.io.gltf.write_skeleton import (
    animated_skeleton,
    write_dequantising_skins,
    write_skeleton,
)
from usdface.io.inputs import among
from usdface.io.udim import texture_files, untiled
from usdface.options import ExportOptions
from usdface.rigs import Mesh, Rig, Skeleton

__all__ = ["write_gltf"]


def write_gltf(
    rig: Rig,
    path: Path,
    clips: Sequence[Clip] = (),
    options: ExportOptions = ExportOptions(),
    read: Iterable[Path] = (),
    metadata: Mapping[str, str] = MappingProxyType({}),
) -> list[Finding]:
    """Write a rig and its clips as .glb or .gltf with a .bin.

    Every mesh becomes one node with one glTF mesh (`usdface.io.gltf.write_mesh`); blend
    shapes become morph targets named by ``mesh.extras.targetNames``. Every clip becomes an
    animation (`usdface.io.gltf.write_animation`); a still one becomes the weights of the nodes.
    The skeleton becomes nodes and one skin, unless it is a single joint that always stands where
    it was bound: that moves nothing, and would only cost bytes and a skinning pass.

    Parameters
    ----------
    rig : Rig
    path : Path
        Ends in .glb or .gltf.
    clips : sequence of Clip
    options : ExportOptions
        `pointer`, `quantize` (POINTS_ROUNDED says by how much vertices are off at most) and
        `influences` have an effect.
    read : iterable of Path
        Files that textures beside a .gltf must not replace; those of the rig's own never are.
    metadata : mapping of str to str
        Of the conversion, for the extras of the asset.

    Returns
    -------
    list of Finding

    Raises
    ------
    OutputError
        If a number does not fit glTF or a file cannot be written; the previous file at `path`
        before is still there.

    Notes
    -----
    Source: glTF 2.0 specification, sections 3.5 (scenes), 3.7 (meshes, skins), 3.11
    (animations). Equal input gives equal bytes.
    """
    builder = BufferBuilder(options.quantize)
    rig, found = untiled(rig)
    uv_names = uv_order(rig)
    textures = TextureBuilder(uv_names)
    materials, new_findings = write_materials(white_base_colors(rig), textures)
    found += new_findings
    by_name = {material.name: material for material in materials}
    if has_faces_without_material(rig):
        by_name[""] = default_material()
    document = pygltflib.GLTF2(
        asset=_asset(rig, uv_names, metadata),
        materials=list(by_name.values()),
        scene=0,
        extensionsUsed=sorted({key for material in materials for key in material.extensions}),
    )
    kept = [*read, *texture_files(rig.materials)]
    beside = textures.into(document, builder, path, among(kept))
    skeleton = animated_skeleton(rig, clips)
    if skeleton is None and rig.skeleton is not None and len(rig.skeleton.joints) > 1:
        message = "its skeleton is bound to no mesh, and left out: {names}"
        names = rig.skeleton.joints
        found.append(finding("FEATURE_DROPPED", rig.name, message, names, feature="skeleton"))
    if skeleton is not None:
        rig, new_findings = _with_fewer_influences(rig, skeleton, clips, options.influences)
        found += new_findings
    held = len(skeleton.joints) if skeleton else 0
    carriers, boxed = _write_meshes(rig, by_name, held, uv_names, document, builder, found)
    write_variants(carriers, list(by_name), document)
    roots = [node for node, _ in carriers]
    joints: dict[str, tuple[int, pygltflib.Node]] = {}
    if skeleton is not None:
        first = len(document.nodes)
        roots += write_skeleton(skeleton, document, builder, found)
        write_dequantising_skins(skeleton, boxed, document, builder)
        joints = {p: (k, document.nodes[k]) for k, p in enumerate(skeleton.joints, first)}
    found += _write_clips(clips, carriers, joints, builder, options.pointer, document)
    write_scene(rig.cameras, rig.lights, document, roots)
    nodes = {path: node for path, (node, _) in joints.items()}
    group_nodes, new_findings = write_groups(rig, carriers, nodes, document, roots)
    found += new_findings
    found += _write_avatar(rig, carriers, nodes, group_nodes, document)
    scene = pygltflib.Scene(name=rig.name, nodes=roots, extras=extras_with_metadata(rig.extras))
    document.scenes = [scene]
    _name_extensions(document, options.quantize)
    document.accessors, document.bufferViews = builder.accessors, builder.views
    save_document(document, builder.blob, beside, path)
    return found


def _write_clips(
    clips: Sequence[Clip],
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, tuple[int, pygltflib.Node]],
    builder: BufferBuilder,
    pointer: bool,
    document: pygltflib.GLTF2,
) -> list[Finding]:
    """Write how the face stands, and an animation for each clip that moves."""
    found = []
    for clip in sorted(clips, key=lambda clip: not clip.still):  # joints move from where they stand
        if clip.still:
            _write_standing(clip, carriers, joints, document)
            continue
        animation, new_findings = write_animation(clip, carriers, joints, builder, pointer)
        found += new_findings
        document.animations += [animation] if animation else []
    return found


def _write_avatar(
    rig: Rig,
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, int],
    groups: Mapping[str, int],
    document: pygltflib.GLTF2,
) -> list[Finding]:
    """Write the VRM avatar that the rig was read from, if it was; nodes by name."""
    avatar = rig.asset.get(VRM)
    if not isinstance(avatar, Mapping):
        return []
    name, content, found = vrm_extension(avatar, carriers, joints, document)
    document.extensions[name] = content
    document.extensionsUsed = sorted({*(document.extensionsUsed or []), name})
    named = NamedNodes({"joint": joints, "group": groups, "mesh": mesh_numbers(carriers)})
    return found + write_vrm_nodes(avatar, name, named, document)


def _name_extensions(document: pygltflib.GLTF2, quantize: bool) -> None:
    """Name the extensions of channels and of quantised vertices, which a reader must know."""
    if any(c.target.path == "pointer" for a in document.animations for c in a.channels):
        document.extensionsUsed = sorted({*(document.extensionsUsed or []), POINTER})
    if quantize:
        names = [*(document.extensionsUsed or []), "KHR_mesh_quantization"]
        document.extensionsUsed, document.extensionsRequired = names, names[-1:]


def _with_fewer_influences(
    rig: Rig, skeleton: Skeleton, clips: Sequence[Clip], most: int
) -> tuple[Rig, list[Finding]]:
    done = [limit_influences(mesh, skeleton, clips, most) for mesh in rig.meshes]
    meshes = tuple(mesh for mesh, _ in done)
    return replace(rig, meshes=meshes), [f for _, found in done for f in found]


def _write_meshes(
    rig: Rig,
    materials: dict[str, pygltflib.Material],
    held: int,
    uv_names: Sequence[str],
    document: pygltflib.GLTF2,
    builder: BufferBuilder,
    found: list[Finding],
) -> tuple[list[tuple[int, Mesh]], list[tuple[int, Box]]]:
    """Give each mesh a node; return the nodes that carry one, and those whose box a skin holds.

    `held` is the number of joints; a mesh without a skin has its box on its node.
    """
    coloured = {"", *(m.name for m in rig.materials if m.vertex_colours)}
    carriers: list[tuple[int, Mesh]] = []
    boxed: list[tuple[int, Box]] = []
    for mesh in rig.meshes:
        box = bounding_box(mesh) if builder.shorts and len(mesh.points) else None
        whole = split_hard_edges(mesh)
        stored = box.boxed(whole) if box else whole
        made, new_findings = write_mesh(stored, materials, builder, held, uv_names, coloured)
        found += new_findings
        if made is None:
            continue
        if box:
            found.append(box.announced(mesh.name))
        node = pygltflib.Node(
            name=mesh.name, mesh=len(document.meshes), extras=extras_with_metadata(mesh.extras)
        )
        if held and mesh.skin is not None:
            node.skin = 0
            boxed += [(len(document.nodes), box)] if box else []
        elif box:
            node.translation, node.scale = box.centre.tolist(), [box.size] * 3
        carriers.append((len(document.nodes), mesh))
        document.nodes.append(node)
        document.meshes.append(made)
    return carriers, boxed


def _asset(rig: Rig, uv_names: Sequence[str], metadata: Mapping[str, str]) -> pygltflib.Asset:
    kept = {key: value for key, value in rig.asset.items() if key != VRM}
    owner = kept.pop("copyright", None)
    if owner is not None and not isinstance(owner, str):
        kept["copyright"], owner = owner, None
    ours = uv_name_extras(uv_names).get("usdface", {}) | dict(metadata)
    extras = extras_with_metadata(kept, usdface=ours)
    return pygltflib.Asset(generator=f"usdface {_version()}", copyright=owner, extras=extras)


def _version() -> str:
    try:
        return version("usdface")
    except PackageNotFoundError:  # run from a source tree that was never installed
        return "(source)"


def _write_standing(
    still: Clip,
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, tuple[int, pygltflib.Node]],
    document: pygltflib.GLTF2,
) -> None:
    """Write how a face stands as the weights of its meshes and the transforms of its nodes."""
    for node, mesh in carriers:
        if mesh.shapes and still.weights is not None:
            weights = flat_weights(mesh, still.weights.reordered(mesh.shape_names).weights[:1])
            document.meshes[document.nodes[node].mesh].weights = weights[0].tolist()
    take = still.joints
    for place, path in enumerate(take.joints if take is not None else ()):
        if path in joints and take is not None:
            _, node = joints[path]
            node.translation = take.translations[0, place].tolist()
            node.rotation = take.rotations[0, place].tolist()
            node.scale = take.scales[0, place].tolist()
