"""The node hierarchy of glTF: order, parents, transforms as row-vector matrices.

glTF stores column-vector matrices column by column, which is the same sixteen numbers as
USD's row-vector matrices row by row; here, as in `usdface.rigs`, a point is a row: p @ M.
"""

from collections.abc import Container
from dataclasses import dataclass, field

import numpy as np
from pygltflib import GLTF2, Node

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.gltf.document import item
from usdface.io.transforms import compose

__all__ = ["NodeTree", "node_tree"]


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
    locals : (N, 4, 4) float64
        Node to parent; row vectors, metres.
    worlds : (N, 4, 4) float64
        Node to scene space.
    """

    order: tuple[int, ...]
    scene: frozenset[int]
    parents: tuple[int, ...]
    locals: FloatArray = field(repr=False)
    worlds: FloatArray = field(repr=False)

    def nearest(self, node: int, among: Container[int]) -> int:
        """Return the first of the nodes `among` from `node` itself upwards; -1 if there is none."""
        while node >= 0 and node not in among:
            node = self.parents[node]
        return node

    def below(self, node: int, above: int) -> FloatArray:
        """Return the transform (4, 4) from `node` to a node `above` it, -1 for the scene."""
        matrix: FloatArray = np.eye(4)
        while node != above:
            matrix = matrix @ self.locals[node]
            node = self.parents[node]
        return matrix


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
                raise InputError(f"node {child} has two parents", "NODES_CYCLIC")
            parents[child] = index
    roots = [index for index, parent in enumerate(parents) if parent == -1]
    first = _scene_roots(document, parents) if document.scenes else roots
    scene = _depth_first(nodes, first)
    order = scene + _depth_first(nodes, [root for root in roots if root not in first])
    if len(order) < len(nodes):
        raise InputError("the nodes form a cycle", "NODES_CYCLIC")
    steps = np.array([_local(node, index) for index, node in enumerate(nodes)]).reshape(-1, 4, 4)
    worlds = steps.copy()
    for index in order:
        if parents[index] >= 0:
            worlds[index] = steps[index] @ worlds[parents[index]]
    if not np.isfinite(worlds).all():
        raise InputError("the transform of a node is not finite", "VALUES_WRONG")
    return NodeTree(tuple(order), frozenset(scene), tuple(parents), steps, worlds)


def _scene_roots(document: GLTF2, parents: list[int]) -> list[int]:
    roots = list(dict.fromkeys(item(document.scenes, document.scene or 0, "scene").nodes or []))
    for root in roots:
        item(document.nodes or [], root, "node")
        if parents[root] != -1:
            raise InputError(
                f"node {root} is a root of the scene and a child of another node", "NODES_CYCLIC"
            )
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
        raise InputError(f"the transform of node {index} is malformed", "VALUES_WRONG")
    return array
