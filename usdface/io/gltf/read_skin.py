"""Skins of glTF as one skeleton: joints, bind and rest transforms.

Other nodes that an animation moves are joints, too: in USD joints move things in
several clips.

Source: glTF 2.0 specification, section 3.7.3 (skins).
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from pygltflib import GLTF2

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.document import item
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.target_names import legal_text
from usdface.io.prim_names import prim_names
from usdface.rigs import Skeleton

__all__ = ["Armature", "armature_of"]

_FLAT = 1e-12  # of a determinant: a scale of 1e-4 along each axis


@dataclass(frozen=True, eq=False, slots=True)
class Armature:
    """The skins of a file, seen as one skeleton.

    Attributes
    ----------
    skeleton : Skeleton or None
    joints : tuple of IntArray
        For each skin, the place of its joints in the skeleton.
    geometry : tuple of FloatArray
        For each skin, the row-vector transform (4, 4) of its meshes to the rig's space at
        bind time.
    nodes : dict of int to int
        Node index to place in the skeleton.
    """

    skeleton: Skeleton | None
    joints: tuple[IntArray, ...]
    geometry: tuple[FloatArray, ...]
    nodes: dict[int, int]

    def to_parent(self, node: int, tree: NodeTree) -> FloatArray:
        """Return the transform (4, 4) from a joint's parent node to its parent joint."""
        return _to_parent(tree, node, self.nodes)


def armature_of(
    document: GLTF2, tree: NodeTree, reader: AccessorReader, moved: Collection[int]
) -> tuple[Armature, list[Finding]]:
    """Merge all skins, and the nodes in `moved`, into one skeleton.

    A glTF skin binds its meshes in a space of its own. With B the bind transform of a joint
    in the rig's space, a skin's inverse bind matrix is G B^-1 for a fixed G (row vectors);
    G is chosen so that the first joint is bound where its node stands (the first that does
    not have scale 0 there), or that joints shared with an earlier skin agree, and is then baked
    into the meshes. This changes no skinned position, and gives metres under any scale of the
    armature.

    Raises
    ------
    InputError
        If a joint does not exist or an inverse bind matrix is malformed or singular.
    """
    found: list[Finding] = []
    bind: dict[int, FloatArray] = {}
    geometry: list[FloatArray] = []
    skins = document.skins or []
    for number, skin in enumerate(skins):
        joints = list(skin.joints or [])
        for joint in joints:
            item(document.nodes or [], joint, "node")
        if not joints or len(set(joints)) != len(joints):
            raise InputError(f"skin {number} has no joints, or one of them twice")
        inverse = _inverse_binds(skin.inverseBindMatrices, len(joints), number, reader)
        stand = bind | {
            joint: tree.worlds[joint]
            for joint in joints
            if joint not in bind and _has_size(tree.worlds[joint])
        }
        anchor = next((k for k, joint in enumerate(joints) if joint in bind), None)
        if anchor is None:
            anchor = next((k for k, joint in enumerate(joints) if joint in stand), None)
        space = np.eye(4) if anchor is None else inverse[anchor] @ stand[joints[anchor]]
        geometry.append(space)
        for joint, own in zip(joints, np.linalg.inv(inverse) @ space, strict=True):
            known = bind.setdefault(joint, own)
            if not np.allclose(known, own, rtol=1e-3, atol=1e-4 * max(1.0, np.abs(known).max())):
                found.append(
                    finding(
                        "FEATURE_DROPPED",
                        f"skin {number}",
                        "node {node} is bound differently by two skins; the first one counts",
                        joint,
                        feature="second_bind_pose",
                    )
                )
    for node in moved:
        world = tree.worlds[node]
        # A joint with scale 0 at rest cannot be bound there.
        bind.setdefault(node, world if _has_size(world) else np.eye(4))
    order = [node for node in tree.order if node in bind]
    nodes = {node: place for place, node in enumerate(order)}
    places = tuple(np.array([nodes[j] for j in skin.joints], np.int64) for skin in skins)
    skeleton = _skeleton(document, tree, order, bind) if order else None
    return Armature(skeleton, places, tuple(geometry), nodes), found


def _has_size(world: FloatArray) -> bool:
    return bool(abs(np.linalg.det(world)) > _FLAT)


def _inverse_binds(
    accessor: int | None, count: int, number: int, reader: AccessorReader
) -> FloatArray:
    if accessor is None:
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    matrices = reader.floats(accessor, "MAT4")
    if len(matrices) < count:
        raise InputError(
            f"skin {number} has {len(matrices)} inverse bind matrices for {count} joints"
        )
    matrices = matrices[:count].reshape(-1, 4, 4)
    if not np.linalg.det(matrices).all():
        raise InputError(f"an inverse bind matrix of skin {number} is singular")
    return matrices


def _skeleton(
    document: GLTF2, tree: NodeTree, order: list[int], bind: dict[int, FloatArray]
) -> Skeleton:
    names = [document.nodes[node].name or f"joint_{node}" for node in order]
    parents = [tree.nearest(tree.parents[node], bind) for node in order]
    paths: dict[int, str] = {}
    rest = []
    legal: dict[int, str] = {}
    for parent in dict.fromkeys(parents):
        children = [k for k, p in enumerate(parents) if p == parent]
        siblings = prim_names([names[k] for k in children])
        legal.update({order[k]: name for k, name in zip(children, siblings, strict=True)})
    for node, parent in zip(order, parents, strict=True):
        paths[node] = legal[node] if parent < 0 else f"{paths[parent]}/{legal[node]}"
        rest.append(tree.locals[node] @ _to_parent(tree, node, bind))
    return Skeleton(
        tuple(paths[node] for node in order),
        tuple(names),
        np.array([bind[node] for node in order]),
        np.array(rest),
        legal_text(next((skin.name for skin in document.skins or [] if skin.name), "")),
    )


def _to_parent(tree: NodeTree, node: int, joints: Collection[int]) -> FloatArray:
    above = tree.parents[node]
    return np.eye(4) if above < 0 else tree.below(above, tree.nearest(above, joints))
