import numpy as np
import pygltflib
import pytest

from usdface.errors import InputError
from usdface.io.gltf.nodes import node_tree

HALF = np.sqrt(0.5)


def document(nodes: list[pygltflib.Node], scene: list[int] | None = None) -> pygltflib.GLTF2:
    scenes = [] if scene is None else [pygltflib.Scene(nodes=scene)]
    return pygltflib.GLTF2(nodes=nodes, scenes=scenes)


def test_children_stand_in_their_parents() -> None:
    nodes = [
        pygltflib.Node(translation=[1, 2, 3]),
        pygltflib.Node(scale=[2, 2, 2], rotation=[0, 0, HALF, HALF], children=[0]),
        pygltflib.Node(matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], children=[1]),
    ]
    tree = node_tree(document(nodes, [2]))
    assert tree.order == (2, 1, 0)
    assert tree.parents == (1, 2, -1)
    np.testing.assert_allclose([0, 0, 0, 1] @ tree.worlds[0], [5 - 4, 6 + 2, 7 + 6, 1])


def test_the_nearest_of_some_nodes_is_looked_for_upwards() -> None:
    chain = [pygltflib.Node(), pygltflib.Node(children=[0]), pygltflib.Node(children=[1])]
    tree = node_tree(document(chain))
    assert tree.nearest(0, {0, 2}) == 0
    assert tree.nearest(0, {2}) == 2
    assert tree.nearest(1, {0}) == tree.nearest(-1, {0}) == -1


def test_only_the_default_scene_counts_as_seen() -> None:
    tree = node_tree(
        document([pygltflib.Node(), pygltflib.Node(children=[2]), pygltflib.Node()], [1])
    )
    assert tree.scene == {1, 2}
    assert tree.order == (1, 2, 0)
    everything = node_tree(document([pygltflib.Node(), pygltflib.Node()]))
    assert everything.scene == {0, 1}


@pytest.mark.parametrize(
    ("children", "scene"),
    [
        ([[1], [0]], []),
        ([[0]], []),
        ([[2], [2], []], []),
        ([[1, 1], []], []),
        ([[1]], []),
        ([[-1]], []),
        ([[1], []], [1]),
        ([[]], [1]),
    ],
)
def test_what_is_not_a_forest_is_refused(children: list[list[int]], scene: list[int]) -> None:
    with pytest.raises(InputError):
        node_tree(document([pygltflib.Node(children=c) for c in children], scene))


@pytest.mark.parametrize(
    "node",
    [
        pygltflib.Node(matrix=[1.0] * 15),
        pygltflib.Node(translation=[0, 0]),
        pygltflib.Node(rotation=[0, 0, 0, 0]),
        pygltflib.Node(scale=[1, float("inf"), 1]),
    ],
)
def test_malformed_transforms_are_refused(node: pygltflib.Node) -> None:
    with pytest.raises(InputError):
        node_tree(document([node]))


def test_deep_hierarchies_need_no_recursion() -> None:
    count = 5000
    nodes = [pygltflib.Node(translation=[1, 0, 0], children=[k + 1]) for k in range(count - 1)]
    tree = node_tree(document([*nodes, pygltflib.Node()]))
    assert tree.worlds[-1][3, 0] == count - 1
