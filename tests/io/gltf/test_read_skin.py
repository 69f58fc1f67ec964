from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.gltf.nodes import compose
from usdface.io.gltf.read import read_gltf
from usdface.rigs import Mesh, Rig

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1]], "<f4")
JOINTS = np.array([[0, 1, 0, 0]] * 6, "<u1")
WEIGHTS = np.repeat(np.array([[1, 0.75, 0.5, 0.25, 0, 0.4]], "<f4").T, 4, 1) * [1, 0, 0, 0]
WEIGHTS[:, 1] = 1 - WEIGHTS[:, 0]


def transform(seed: int, scale: float = 1.0) -> tuple[np.ndarray, dict[str, list[float]]]:
    """A row-vector matrix, and the same as node properties."""
    rng = np.random.default_rng(seed)
    move, turn = rng.normal(size=3), rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    fields = {"translation": move.tolist(), "rotation": turn.tolist(), "scale": [scale] * 3}
    return compose(move, turn, np.full(3, scale)), fields


def world(nodes: list[dict[str, Any]], skins: int = 1, **more: object) -> dict[str, Any]:
    primitive = {"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}
    return {
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 3 + k} for k in range(skins)],
    } | more


def skinned(rig: Rig, mesh: Mesh) -> np.ndarray:
    """Points at rest: linear blend skinning as UsdSkel defines it."""
    skeleton = rig.skeleton
    assert skeleton is not None
    assert mesh.skin is not None
    at_rest: dict[str, np.ndarray] = {}
    for path, rest in zip(skeleton.joints, skeleton.rest, strict=True):
        parent = path.rpartition("/")[0]
        at_rest[path] = rest @ at_rest[parent] if parent else rest
    moves = np.linalg.inv(skeleton.bind) @ np.stack([at_rest[path] for path in skeleton.joints])
    return blended(mesh.points, mesh.skin.joints, mesh.skin.weights, moves)


def blended(points, joints, weights, moves) -> np.ndarray:
    points = np.c_[points, np.ones(len(points))]
    return np.einsum("vk,vi,vkij->vj", weights, points, moves[joints])[:, :3]


def test_a_skin_looks_the_same_at_rest_whatever_it_was_bound_to(write_glb, tmp_path: Path) -> None:
    root, root_fields = transform(1, 2.0)
    joint, joint_fields = transform(2)
    between, between_fields = transform(3, 0.5)
    tip, tip_fields = transform(4, 1.5)
    inverse = np.stack([transform(5, 100.0)[0], transform(6, 90.0)[0]])
    nodes = [
        {"children": [1, 4], **root_fields},
        {"name": "Neck bone", "children": [3], **joint_fields},
        {"name": "Head", **tip_fields},
        {"children": [2], **between_fields},  # not a joint
        {"mesh": 0, "skin": 0, "translation": [7, 8, 9]},  # which skins ignore
    ]
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4"), inverse.reshape(2, 16).astype("<f4")]
    rig, _, found = read_gltf(write_glb(tmp_path / "a.glb", world(nodes), arrays))
    assert found == []
    assert rig.skeleton is not None
    assert rig.skeleton.joints == ("Neck_bone", "Neck_bone/Head")
    assert rig.skeleton.names == ("Neck bone", "Head")
    moves = inverse @ np.stack([joint @ root, tip @ between @ joint @ root])
    expected = blended(POINTS, JOINTS, WEIGHTS, moves)
    np.testing.assert_allclose(skinned(rig, rig.meshes[0]), expected, rtol=1e-5, atol=1e-4)
    # The first joint is bound where it stands, so that the mesh is as large as it looks.
    np.testing.assert_allclose(rig.skeleton.bind[0], joint @ root, rtol=1e-4, atol=1e-4)


def test_without_inverse_bind_matrices_meshes_are_bound_at_their_joints(
    write_glb, tmp_path: Path
) -> None:
    nodes = [{"children": [1]}, {"translation": [1, 2, 3], "children": [2, 3]}, {}]
    nodes.append({"mesh": 0, "skin": 0})
    document = world(nodes) | {"skins": [{"joints": [1, 2]}]}
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4")]
    rig, _, _ = read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
    np.testing.assert_allclose(rig.meshes[0].points, POINTS + np.array([1, 2, 3]))
    np.testing.assert_allclose(skinned(rig, rig.meshes[0]), POINTS + np.array([1, 2, 3]), atol=1e-6)
    assert rig.skeleton is not None
    assert rig.skeleton.joints == ("joint_1", "joint_1/joint_2")


@pytest.mark.parametrize("flat", [{1}, {1, 2}])
def test_joints_that_are_scaled_to_nothing_at_rest_keep_their_mesh(
    write_glb, tmp_path: Path, flat: set[int]
) -> None:
    """It is not seen at rest, and grows when a clip scales them."""
    nodes: list[dict[str, Any]] = [{"children": [1, 2, 3]}, {}, {}, {"mesh": 0, "skin": 0}]
    for joint in flat:
        nodes[joint]["scale"] = [0, 0, 0]
    document = world(nodes) | {"skins": [{"joints": [1, 2]}]}
    rig, _, _ = read_gltf(
        write_glb(tmp_path / "a.glb", document, [POINTS, JOINTS, WEIGHTS.astype("<f4")])
    )
    np.testing.assert_array_equal(rig.meshes[0].points, POINTS)
    assert rig.skeleton is not None
    np.testing.assert_allclose(rig.skeleton.bind, [np.eye(4)] * 2)
    shown = skinned(rig, rig.meshes[0])
    np.testing.assert_allclose(shown, POINTS * (WEIGHTS[:, 1:2] if flat == {1} else 0), atol=1e-6)


def test_two_skins_in_spaces_of_their_own_become_one_skeleton(write_glb, tmp_path: Path) -> None:
    binds = np.stack([transform(1)[0], transform(2)[0]])
    first = np.linalg.inv(binds)
    second = transform(9, 50.0)[0] @ first
    nodes = [
        {"children": [1, 3, 4]},
        {"children": [2], **transform(1)[1]},
        transform(3)[1],
        {"mesh": 0, "skin": 0},
        {"mesh": 0, "skin": 1, "name": "other"},
    ]
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4")]
    arrays += [m.reshape(2, 16).astype("<f4") for m in (first, second)]
    rig, _, found = read_gltf(write_glb(tmp_path / "a.glb", world(nodes, 2), arrays))
    assert found == []
    assert rig.skeleton is not None
    assert len(rig.skeleton.joints) == 2
    stand = np.stack([transform(1)[0], transform(3)[0] @ transform(1)[0]])
    for mesh, inverse in zip(rig.meshes, (first, second), strict=True):
        expected = blended(POINTS, JOINTS, WEIGHTS, inverse @ stand)
        np.testing.assert_allclose(skinned(rig, mesh), expected, rtol=1e-4, atol=1e-3)


def test_skins_that_bind_a_joint_differently_are_announced(write_glb, tmp_path: Path) -> None:
    first = np.stack([np.eye(4)] * 2)
    second = first.copy()
    second[1, 3, 0] = 1.0
    nodes = [{"children": [1, 3, 4]}, {"children": [2]}, {}]
    nodes += [{"mesh": 0, "skin": 0}, {"mesh": 0, "skin": 1, "name": "other"}]
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4")]
    arrays += [m.reshape(2, 16).astype("<f4") for m in (first, second)]
    _, _, found = read_gltf(write_glb(tmp_path / "a.glb", world(nodes, 2), arrays))
    assert [(f.code, f.where) for f in found if f.severity != "info"] == [
        ("FEATURE_DROPPED", "skin 1")
    ]


def test_a_mesh_that_hangs_on_a_joint_follows_it(write_glb, tmp_path: Path) -> None:
    joint, fields = transform(1)
    own, own_fields = transform(2, 3.0)
    inverse = np.stack([transform(5)[0], transform(6)[0]])
    nodes = [
        {"children": [1, 4]},
        {"children": [2], **fields},
        {"children": [3]},
        {"mesh": 1, **own_fields},
        {"mesh": 0, "skin": 0},
    ]
    document = world(nodes)
    document["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}}]})
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4"), inverse.reshape(2, 16).astype("<f4")]
    rig, _, _ = read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
    hung = rig.meshes[0]
    assert hung.skin is not None
    assert hung.skin.joints[0] == [1]
    expected = (np.c_[POINTS, np.ones(6)] @ own @ joint)[:, :3]
    # the two coinciding pairs of points are welded, in the order of first appearance
    np.testing.assert_allclose(
        skinned(rig, hung),
        expected[[0, 1, 2, 5]],
        atol=1e-5,
    )


def test_siblings_of_one_name_get_paths_of_their_own(write_glb, tmp_path: Path) -> None:
    nodes = [{"children": [1, 2, 3]}, {"name": "a.b"}, {"name": "a.b"}, {"mesh": 0, "skin": 0}]
    document = world(nodes) | {"skins": [{"joints": [2, 1]}]}
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4")]
    rig, _, _ = read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
    assert rig.skeleton is not None
    assert rig.skeleton.joints == ("a_b", "a_b_1")
    assert rig.meshes[0].skin is not None
    np.testing.assert_array_equal(rig.meshes[0].skin.joints[0], [1, 0, 1, 1])


@pytest.mark.parametrize(
    "skin",
    [
        {"joints": [1, 7]},
        {"joints": []},
        {"joints": [1, 1]},
        {"joints": [1]},  # the mesh names joint 1 of it
        {"joints": [1, 2], "inverseBindMatrices": 0},
        {"joints": [1, 2], "inverseBindMatrices": 3},  # singular
        {"joints": [1, 2], "inverseBindMatrices": 4},  # one for two
    ],
)
def test_malformed_skins_are_refused(write_glb, tmp_path: Path, skin: dict[str, Any]) -> None:
    nodes = [{"children": [1, 2, 3]}, {}, {}, {"mesh": 0, "skin": 0}]
    document = world(nodes) | {"skins": [skin]}
    one = np.eye(4, dtype="<f4").reshape(1, 16)
    arrays = [POINTS, JOINTS, WEIGHTS.astype("<f4"), np.zeros((2, 16), "<f4"), one]
    with pytest.raises(InputError):
        read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
