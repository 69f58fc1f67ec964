"""The node hierarchy of glTF: order, parents, transforms as row-vector matrices.

glTF stores column-vector matrices column by column, which is the same sixteen numbers as
USD's row-vector matrices row by row; here, as in `usdface.rigs`, a point is a row: p @ M.
"""

from dataclasses import dataclass, field

import numpy as np
from pygltflib import GLTF2, Node
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.io.gltf.document import item
from usdface.takes import FloatArray

__all__ = ["NodeTree", "compose", "decompose", "node_tree"]


@dataclass(frozen=True, eq=False, slots=True)
class NodeTree:
    """All nodes of a file.

    Attributes
    ----------
    order : tuple of int, length N
        All nodes, parents before children, the default scene first.
    scene : frozenset of int
        Nodes of the default scene.
    parents : tuple of int, length N
        Parent of each node, -1 for a root.
    worlds : (N, 4, 4) float64
        Node to scene space; row vectors, metres.
    """

    order: tuple[int, ...]
    scene: frozenset[int]
    parents: tuple[int, ...]
    worlds: FloatArray = field(repr=False)


def node_tree(document: GLTF2) -> NodeTree:
    """Return the hierarchy of a document.

    Raises
    ------
    InputError
        If a child or a scene's root does not exist, a node has two parents, or a
        transform is malformed.
    """
    nodes = document.nodes or []
    parents = [-1] * len(nodes)
    for index, node in enumerate(nodes):
        for child in (node.children if node else None) or []:
            item(nodes, child, "node")
            if parents[child] != -1:
                raise InputError(f"node {child} has two parents")
            parents[child] = index
    roots = [index for index, parent in enumerate(parents) if parent == -1]
    first = _scene_roots(document, parents) if document.scenes else roots
    scene = _depth_first(nodes, first)
    order = scene + _depth_first(nodes, [root for root in roots if root not in first])
    if len(order) < len(nodes):
        raise InputError("the nodes form a cycle")
    worlds = np.broadcast_to(np.eye(4), (len(nodes), 4, 4)).copy()
    for index in order:
        local = _local(nodes[index], index)
        worlds[index] = local if parents[index] < 0 else local @ worlds[parents[index]]
    if not np.isfinite(worlds).all():
        raise InputError("the transform of a node is not finite")
    return NodeTree(tuple(order), frozenset(scene), tuple(parents), worlds)


def _scene_roots(document: GLTF2, parents: list[int]) -> list[int]:
    roots = list(dict.fromkeys(item(document.scenes, document.scene or 0, "scene").nodes or []))
    for root in roots:
        item(document.nodes or [], root, "node")
        if parents[root] != -1:
            raise InputError(f"node {root} is a root of the scene and a child of another node")
    return roots


def _depth_first(nodes: list[Node], roots: list[int]) -> list[int]:
    order: list[int] = []
    waiting = roots[::-1]
    while waiting:
        index = waiting.pop()
        order.append(index)
        waiting.extend(reversed(item(nodes, index, "node").children or []))
    return order


def _local(node: Node, index: int) -> FloatArray:
    if node.matrix is not None:
        return _numbers(node.matrix, 16, index).reshape(4, 4)
    return compose(
        _numbers(node.translation or (0, 0, 0), 3, index),
        _numbers(node.rotation or (0, 0, 0, 1), 4, index),
        _numbers(node.scale or (1, 1, 1), 3, index),
    )


def _numbers(values: object, count: int, index: int) -> FloatArray:
    array = np.asarray(values, np.float64)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise InputError(f"the transform of node {index} is malformed")
    return array


def compose(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the row-vector matrix (4, 4) that scales, rotates (x, y, z, w), then moves.

    Raises
    ------
    InputError
        If the quaternion is zero.
    """
    if not rotation.any():
        raise InputError("a rotation is the zero quaternion")
    matrix = np.eye(4)
    matrix[:3, :3] = scale[:, None] * Rotation.from_quat(rotation).as_matrix().T
    matrix[3, :3] = translation
    return matrix


def decompose(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return translation (3,), rotation (4,) as x, y, z, w with w >= 0, and scale (3,).

    The inverse of `compose` where the matrix has no shear; a mirror becomes a negative
    scale along x.
    """
    scale = np.linalg.norm(matrix[:3, :3], axis=1)
    if np.linalg.det(matrix[:3, :3]) < 0:
        scale[0] = -scale[0]
    axes = matrix[:3, :3] / np.where(scale == 0, 1.0, scale)[:, None]
    if np.linalg.det(axes) <= 0:  # flattened by a zero scale: any rotation will do
        return matrix[3, :3], np.array([0.0, 0.0, 0.0, 1.0]), scale
    return matrix[3, :3], Rotation.from_matrix(axes.T).as_quat(canonical=True), scale
