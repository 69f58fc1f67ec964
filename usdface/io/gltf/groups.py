"""Nodes of glTF without content of their own, read and written."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from pygltflib import GLTF2, Node

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.gltf.extras import extras_with_metadata, read_extras
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.read_skin import Armature
from usdface.io.gltf.read_weights import PlacedMesh
from usdface.io.gltf.target_names import legal_text
from usdface.io.prim_names import prim_names
from usdface.io.transforms import compose, decompose
from usdface.rigs import Mesh, Rig
from usdface.scene import Extras, Group

__all__ = [
    "SKELETON_ROOT",
    "hang_in_groups",
    "read_groups",
    "read_joint_extras",
    "write_groups",
]

_MOST = 2**13  # groups that are kept of a file
SKELETON_ROOT = {"skeletonRoot": True}  # extras of the node that the writer hangs joints on
_LIGHTS = "KHR_lights_punctual"
_SHEAR = 1e-5  # of a matrix, as the certificate's limit


def read_groups(
    document: GLTF2, tree: NodeTree, armature: Armature
) -> tuple[dict[int, Group], list[Finding]]:
    """Return the nodes of the scene that are no joints and carry nothing, by their index.

    Cameras, lights and meshes are read elsewhere (`in_groups`).

    Returns
    -------
    dict of int to Group
        Parents before children.
    list of Finding
        NODES_DROPPED for those beyond 8,192, FEATURE_DROPPED for the content of other scenes.
    """
    bare, elsewhere = [], []
    for index in tree.order:
        node = document.nodes[index]
        carries = node.mesh is not None or node.camera is not None
        carries = carries or _LIGHTS in (node.extensions or {})
        if index not in tree.scene:
            elsewhere += [_name(node, index)] if carries else []
        elif not (carries or index in armature.nodes or _is_skeleton_root(node)):
            bare.append(index)
    found = []
    if elsewhere:
        message = "{node_count} nodes are not in the default scene, and left out: {nodes}"
        values = len(elsewhere), elsewhere
        found.append(finding("FEATURE_DROPPED", "scenes", message, *values, feature="scenes"))
    if len(bare) > _MOST:
        message = "{node_count} nodes are left out, their transforms kept: {nodes}"
        names = [_name(document.nodes[k], k) for k in bare[_MOST:]]
        found.append(finding("NODES_DROPPED", "nodes", message, len(names), names))
    kept = dict.fromkeys(bare[:_MOST])
    above = {index: _above(tree, index, kept, armature) for index in kept}
    siblings: dict[int, list[int]] = {}
    for index, (parent, _) in above.items():
        siblings.setdefault(parent, []).append(index)
    paths: dict[int, str] = {-1: ""}
    groups: dict[int, Group] = {}
    for index in kept:
        parent, joint = above[index]
        if index not in paths:  # the first of its siblings
            legal = prim_names([_name(document.nodes[k], k) for k in siblings[parent]])
            before = f"{paths[parent]}/" if paths[parent] else ""
            paths |= {k: before + n for k, n in zip(siblings[parent], legal, strict=True)}
        node = document.nodes[index]
        name = _name(node, index)
        extras, new_findings = read_extras(node.extras, where=name)
        found += new_findings
        on = ""
        if joint >= 0 and armature.skeleton is not None:
            on = armature.skeleton.joints[armature.nodes[joint]]
        groups[index] = Group(paths[index], name, tree.worlds[index], on, extras)
    return groups, found


def _is_skeleton_root(node: Node) -> bool:
    return isinstance(node.extras, Mapping) and node.extras.get("usdface") == SKELETON_ROOT


def _name(node: Node, index: int) -> str:
    return legal_text(node.name or f"node {index}")


def _above(
    tree: NodeTree, index: int, kept: Mapping[int, object], armature: Armature
) -> tuple[int, int]:
    """Return the group that a node is in, -1 for none, and else the joint that it hangs on."""
    parent = tree.parents[index]
    while parent >= 0 and parent not in kept and parent not in armature.nodes:
        parent = tree.parents[parent]
    return (parent, -1) if parent in kept else (-1, parent)


def hang_in_groups(
    meshes: Sequence[PlacedMesh],
    finished: Sequence[Mesh],
    tree: NodeTree,
    groups: Mapping[int, Group],
    armature: Armature,
) -> tuple[Mesh, ...]:
    """Return the meshes, those in a group with its path."""
    above = [_above(tree, placed.node, groups, armature)[0] for placed in meshes]
    return tuple(
        replace(mesh, group=groups[parent].path) if parent >= 0 else mesh
        for mesh, parent in zip(finished, above, strict=True)
    )


def read_joint_extras(
    document: GLTF2, armature: Armature
) -> tuple[dict[str, Extras], list[Finding]]:
    """Return the extras of joints that carry nothing else, by path of the joint."""
    kept: dict[str, Extras] = {}
    found: list[Finding] = []
    for index, place in armature.nodes.items():
        node = document.nodes[index]
        held = node.mesh is not None or node.camera is not None  # theirs
        if held or armature.skeleton is None:
            continue
        extras, new_findings = read_extras(node.extras, where=_name(node, index))
        found += new_findings
        if extras:
            kept[armature.skeleton.joints[place]] = extras
    return kept, found


# -- out -----------------------------------------------------------------------------------


def write_groups(
    rig: Rig,
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, int],
    document: GLTF2,
    roots: list[int],
) -> tuple[dict[str, int], list[Finding]]:
    """Append a node for each group, and hang those on joints and each other, and meshes in them.

    A skinned mesh stays at the root of the scene, as the specification advises; so does a node
    whose transform a scaling group could not reproduce.

    Returns
    -------
    mapping of str to int
        Node of each group.
    list of Finding
    """
    worlds = _worlds(document)
    nodes: dict[str, int] = {}
    found: list[Finding] = []
    for group in rig.groups:
        parent = nodes.get(group.path.rpartition("/")[0], joints.get(group.joint, -1))
        node = Node(name=group.name, extras=extras_with_metadata(group.extras))
        nodes[group.path] = len(document.nodes)
        worlds.append(group.matrix)
        document.nodes.append(node)
        if not _hang(document, worlds, nodes[group.path], parent, roots):
            message = "its transform is no scale, rotation and translation in glTF"
            found.append(finding("FEATURE_APPROXIMATED", group.name, message, feature="shear"))
            _place(node, group.matrix)
    for node, mesh in carriers:
        if mesh.group in nodes and document.nodes[node].skin is None:
            roots.remove(node)
            _hang(document, worlds, node, nodes[mesh.group], roots)
    for path, extras in rig.joint_extras.items():
        if path in joints:
            document.nodes[joints[path]].extras = extras_with_metadata(extras)
    return nodes, found


def _worlds(document: GLTF2) -> list[FloatArray]:
    """Return the world transforms of all nodes."""
    rest = np.array([0.0, 0, 0]), np.array([0.0, 0, 0, 1]), np.ones(3)
    given = [(n.translation, n.rotation, n.scale) for n in document.nodes]
    worlds = [
        compose(*(np.array(r if v is None else v) for v, r in zip(parts, rest, strict=True)))
        for parts in given
    ]
    parents = {child: k for k, node in enumerate(document.nodes) for child in node.children or []}
    done = set[int]()

    def settle(index: int) -> None:
        line = [index]
        while line[-1] in parents and parents[line[-1]] not in done:
            line.append(parents[line[-1]])
        for node in reversed(line):
            if node in parents and node not in done:
                worlds[node] = worlds[node] @ worlds[parents[node]]
            done.add(node)

    for index in range(len(worlds)):
        if index not in done:
            settle(index)
    return worlds


def _hang(
    document: GLTF2, worlds: Sequence[FloatArray], index: int, parent: int, roots: list[int]
) -> bool:
    """Parent a node to another and keep its world transform; to the scene where that is impossible.

    Returns whether its world transform is exact.
    """
    above = worlds[parent] if parent >= 0 else np.eye(4)
    for over, matrix in ((parent, worlds[index] @ np.linalg.pinv(above)), (-1, worlds[index])):
        if _place(document.nodes[index], matrix) and (
            over < 0 or np.allclose(matrix @ above, worlds[index], rtol=_SHEAR, atol=_SHEAR)
        ):
            (document.nodes[over].children if over >= 0 else roots).append(index)
            return True
    roots.append(index)
    return False


def _place(node: Node, matrix: FloatArray) -> bool:
    """Give a node a transform; return whether it is the matrix."""
    parts = decompose(matrix)
    node.translation, node.rotation, node.scale = (part.tolist() for part in parts)
    return np.allclose(compose(*parts), matrix, rtol=_SHEAR, atol=_SHEAR)
