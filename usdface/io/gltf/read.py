"""glTF 2.0 to a rig and its clips."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import compress
from operator import not_
from pathlib import Path
from typing import Any

import numpy as np
from pygltflib import GLTF2, Scene

from usdface.arrays import FloatArray
from usdface.clips import Clip
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.bake_transform import bake_transform
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.decompress import decompress
from usdface.io.gltf.document import GltfFile, item, load_document
from usdface.io.gltf.errors import schema_errors
from usdface.io.gltf.extras import read_extras
from usdface.io.gltf.groups import hang_in_groups, read_groups, read_joint_extras
from usdface.io.gltf.ignored_parts import (
    report_extensions,
    report_extras,
    report_names,
    report_pivots,
    report_unplaced,
)
from usdface.io.gltf.inbetweens import Step, steps_in
from usdface.io.gltf.instances import expand_instances
from usdface.io.gltf.materials import read_materials
from usdface.io.gltf.nodes import NodeTree, node_tree
from usdface.io.gltf.read_animation import animated_nodes, clips_of
from usdface.io.gltf.read_mesh import mesh_of_primitives
from usdface.io.gltf.read_skin import Armature, armature_of
from usdface.io.gltf.read_weights import PlacedMesh
from usdface.io.gltf.scene import read_scene
from usdface.io.gltf.target_names import legal_text, target_names, unique_names, with_labels
from usdface.io.gltf.textures import read_uv_names
from usdface.io.gltf.variants import read_variants
from usdface.io.gltf.vertex_colours import is_default_material, multiply_by_base_color
from usdface.io.gltf.vrm import VRM, read_vrm
from usdface.io.gltf.vrm_nodes import NamedNodes, mesh_numbers, read_vrm_nodes
from usdface.rigs import Mesh, Rig, Skin
from usdface.scene import Group

__all__ = ["read_gltf"]

_MOST_NUMBERS = 2**29  # in all vertex attributes and morph targets of a scene, 4 GiB as float64
_NUMBERS_PER_BYTE = 64  # of these, for each byte of the file: sparse targets and instances unfold
_FEW_NUMBERS = 2**22  # that any file may unfold into


def read_gltf(
    path: Path, asset_root: Path | None = None
) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    """Read the default scene of a .glb or .gltf file.

    Node transforms are baked into meshes without a skin; skinned meshes stand as they were
    bound. All skins and all animated nodes become one skeleton (`usdface.io.gltf.read_skin`),
    and a mesh without a skin that hangs on a joint is bound to it. Primitives of a mesh become
    one mesh with material subsets (`usdface.io.gltf.read_mesh`). Every animation becomes a clip
    (`usdface.io.gltf.read_animation`).

    Parameters
    ----------
    path : Path
    asset_root : Path, optional
        A folder that buffers and images may come from beside that of the file.

    Returns
    -------
    Rig
        Metres, Y up; blend shapes are named by ``extras.targetNames``, else ``target_0``,
        ``target_1``, ... (`usdface.io.gltf.target_names`).
    tuple of Clip
        One without a name where nothing is animated but some weights are not zero.
    list of Finding

    Raises
    ------
    InputError
        If the file cannot be read, is not valid where it matters, or requires an extension
        that is not decoded.
    """
    with schema_errors(path):
        return _read(path, asset_root)


def _read(path: Path, asset_root: Path | None) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    file = expand_instances(decompress(load_document(path, asset_root)))
    document = file.document
    reader = AccessorReader(file)
    tree = node_tree(document)
    carriers = [n for n in tree.order if n in tree.scene and document.nodes[n].mesh is not None]
    _check_size(document, carriers, reader)
    names, found = _material_names(document)
    uv_names = read_uv_names(document.asset.extras)
    materials, new_findings = read_materials(file, names, uv_names)
    materials = tuple(material for material in materials if material.name)
    found += new_findings
    armature, new_findings = armature_of(document, tree, reader, animated_nodes(file, tree))
    found += new_findings
    meshes, new_findings = _meshes(file, carriers, names, uv_names, reader)
    found += new_findings
    if not meshes:
        why = (
            "; ".join(f"{f.where}: {f.message}" for f in new_findings)
            or "no node of its scene has one"
        )
        raise InputError(f"there is no mesh with triangles to read: {why}", "FACE_MISSING")
    found += _report_half_skinned(meshes, document)
    for k, m in enumerate(meshes):  # in place: two of each would be twice the memory
        coloured = multiply_by_base_color(m.mesh, materials)
        meshes[k] = replace(m, mesh=_in_rig_space(coloured, m.node, document, tree, armature))
    finished, clips, new_findings = clips_of(file, meshes, tree, armature, reader)
    found += new_findings
    scene = item(document.scenes, document.scene or 0, "scene") if document.scenes else Scene()
    cameras, lights, new_findings = read_scene(document, tree, animated_nodes(file, tree))
    found += new_findings
    extras, new_findings = read_extras(scene.extras, where="scene")
    found += new_findings
    asset, new_findings = read_extras(document.asset.extras, where="asset")
    found += new_findings
    found += report_extensions(file) + report_extras(file) + report_unplaced(document)
    found += report_pivots(document, tree, armature.nodes)
    groups, new_findings = read_groups(document, tree, armature)
    found += new_findings
    joint_extras, new_findings = read_joint_extras(document, armature)
    found += new_findings
    finished, new_findings = read_variants(document, meshes, finished, names)
    found += new_findings
    finished = hang_in_groups(meshes, finished, tree, groups, armature)
    carried = {placed.node: mesh for placed, mesh in zip(meshes, finished, strict=True)}
    avatar, new_findings = _avatar(document, carried, armature, groups)
    found += new_findings
    if avatar:
        asset |= {VRM: avatar}
    if document.asset.copyright:
        asset = {"copyright": document.asset.copyright} | asset
    name = legal_text(scene.name or path.stem)
    rig = Rig(name, finished, armature.skeleton, materials, path.name, cameras, lights)
    rig = replace(rig, extras=extras, asset=asset, joint_extras=joint_extras)
    found += report_names(file, rig.shape_names)
    return replace(rig, groups=tuple(groups.values())), clips, found


def _material_names(document: GLTF2) -> tuple[tuple[str, ...], list[Finding]]:
    """Return the unique name of each material; "" of one that says nothing."""
    bare = [is_default_material(material) for material in document.materials or []]
    kept = compress(document.materials or [], map(not_, bare))
    unique, found = unique_names([material.name or "Material" for material in kept], "material")
    named = iter(unique)
    return tuple("" if none else next(named) for none in bare), found


def _avatar(
    document: GLTF2, carried: dict[int, Mesh], armature: Armature, groups: dict[int, Group]
) -> tuple[dict[str, Any], list[Finding]]:
    """Return the VRM avatar of a file, if there is one, with the parts that name its nodes."""
    paths = armature.skeleton.joints if armature.skeleton else ()
    joints = {node: paths[place] for node, place in armature.nodes.items()}
    avatar, found = read_vrm(document, carried, joints)
    if not avatar:
        return {}, found
    of_joints = {path: node for node, path in joints.items()}
    of_groups = {group.path: node for node, group in groups.items()}
    of_meshes = mesh_numbers(carried.items())
    nodes = NamedNodes({"joint": of_joints, "group": of_groups, "mesh": of_meshes})
    moving, new_findings = read_vrm_nodes(document, nodes)
    return avatar | moving, found + new_findings


def _check_size(document: GLTF2, carriers: list[int], reader: AccessorReader) -> None:
    """Refuse a small file that unfolds into a huge scene, before anything is allocated."""
    sizes: dict[int, int] = {}
    total = 0
    held = sum(map(len, reader.file.buffers))
    most = min(_MOST_NUMBERS, _FEW_NUMBERS + _NUMBERS_PER_BYTE * held)
    for node in carriers:
        index = document.nodes[node].mesh
        if index not in sizes:
            sizes[index] = sum(
                4 * read(accessor)
                for primitive in item(document.meshes or [], index, "mesh").primitives
                for read, accessors in (
                    (reader.count, (*vars(primitive.attributes).values(), primitive.indices)),
                    *((reader.stored, target.values()) for target in primitive.targets or []),
                )
                for accessor in accessors
                if accessor is not None
            )
        total += sizes[index]
        if total > most:
            raise InputError(
                f"the scene unfolds into more than {most} numbers, from {held} bytes; "
                "split it, or leave out everything but the character",
                "TOO_LARGE",
            )


def _meshes(
    file: GltfFile,
    carriers: list[int],
    materials: tuple[str, ...],
    uv_names: tuple[str, ...],
    reader: AccessorReader,
) -> tuple[list[PlacedMesh], list[Finding]]:
    """Decode the mesh of each node that carries one; a mesh used twice is decoded once."""
    document = file.document
    names = [
        legal_text(document.nodes[n].name or document.meshes[document.nodes[n].mesh].name or "Mesh")
        for n in carriers
    ]
    found: list[Finding] = []
    decoded: dict[int, Mesh | None] = {}
    steps: dict[int, tuple[Step, ...]] = {}
    meshes = []
    for node, name in zip(carriers, names, strict=True):
        index = document.nodes[node].mesh
        source = document.meshes[index]
        if index not in decoded:
            shape_names, labels, new_findings = target_names(
                source, name, document.nodes[node].extras, document.accessors or ()
            )
            decoded[index], lost = mesh_of_primitives(
                name, source.primitives or [], shape_names, materials, reader, uv_names
            )
            decoded[index] = with_labels(decoded[index], labels)
            found += [*new_findings, *lost]
            between = steps_in(source.extras, shape_names)
            if between is None:
                message = "its extras name inbetweens that make no sense; they stay shapes"
                found.append(finding("INBETWEEN_FLAT", name, message))
            steps[index] = between or ()
        mesh = decoded[index]
        if mesh is not None:
            weights = _still_weights(file.node_weights[node] or source.weights, mesh)
            extras, lost = read_extras(source.extras, document.nodes[node].extras, where=name)
            found += lost
            own = legal_text(source.name or name)
            named = replace(mesh, name=name, extras=extras, content_name=own if own != name else "")
            meshes.append(PlacedMesh(named, node, weights, steps[index]))
    return meshes, found


def _report_half_skinned(meshes: Iterable[PlacedMesh], document: GLTF2) -> list[Finding]:
    """Return FEATURE_DROPPED for influences without a skin, and skins without influences."""
    found = []
    for placed in meshes:
        influences, skin = placed.mesh.skin, document.nodes[placed.node].skin
        if (influences is None) == (skin is None):
            continue
        message = "influences of joints are left out, as its node has no skin"
        if influences is None:
            message = "the skin of its node is left out, as it has no influences of joints"
        found.append(finding("FEATURE_DROPPED", placed.mesh.name, message, feature="skin"))
    return found


def _still_weights(given: list[float] | None, of: Mesh) -> FloatArray:
    weights = np.asarray(given or np.zeros(len(of.shapes)), np.float64)
    if weights.shape != (len(of.shapes),) or not np.isfinite(weights).all():
        raise InputError(
            f"mesh {of.name!r} has {weights.size} weights for {len(of.shapes)} morph targets"
        )
    return weights


def _in_rig_space(
    mesh: Mesh, node: int, document: GLTF2, tree: NodeTree, armature: Armature
) -> Mesh:
    skin = document.nodes[node].skin
    if skin is not None and mesh.skin is not None:
        joints = item(armature.joints, skin, "skin")
        own = mesh.skin.joints
        if own.min() < 0 or own.max() >= len(joints):
            raise InputError(f"mesh {mesh.name!r} is skinned to a joint that skin {skin} lacks")
        bound = replace(mesh, skin=Skin(joints[own], mesh.skin.weights))
        return bake_transform(bound, armature.geometry[skin])
    joint = node
    while joint >= 0 and joint not in armature.nodes:
        joint = tree.parents[joint]
    if joint < 0 or armature.skeleton is None:
        return bake_transform(replace(mesh, skin=None), tree.worlds[node])
    place = armature.nodes[joint]
    # The joint may stand elsewhere than where it was bound: go back there with it.
    world = tree.below(node, joint) @ armature.skeleton.bind[place]
    count = len(mesh.points)
    rigid = Skin(np.full((count, 1), place), np.ones((count, 1)))
    return bake_transform(replace(mesh, skin=rigid), world)
