import json
from pathlib import Path

import numpy as np
import pytest
from clips import evaluate_gltf

from usdface.errors import InputError

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], "<f4")
MOVE = np.array([[0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]], "<f4")
CORNERS = np.array([0, 1, 2], "<u2")
TIMES = np.array([1, 2, 4], "<f4")
WEIGHTS = np.array([0, 1, 3], "<f4")


def document(**more: object) -> dict[str, object]:
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1}
    primitive["targets"] = [{"POSITION": 2, "NORMAL": 2}]
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    return {
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["up"]}}],
        "nodes": [{"name": "n", "mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "animations": [{"samplers": [{"input": 3, "output": 4}], "channels": [channel]}],
    } | more


ARRAYS = [POINTS, CORNERS, MOVE, TIMES, WEIGHTS]


def test_weights_move_points_in_time(tmp_path: Path, write_glb) -> None:
    (shown,) = evaluate_gltf(write_glb(tmp_path / "a.glb", document(), ARRAYS))
    times = np.array([0.0, 1.5, 3.0, 9.0])
    assert (shown.name, shown.targets, len(shown.points)) == ("n", ("up",), 3)
    np.testing.assert_allclose(shown.weights_at(times)[:, 0], [0, 0.5, 2, 3])
    np.testing.assert_allclose(shown.points_at(times)[:, 0, 2], [0, 0.5, 2, 3])
    np.testing.assert_allclose(shown.points_at(times)[:, 1], np.tile([1, 0, 0], (4, 1)))


def test_steps_hold(tmp_path: Path, write_glb) -> None:
    changed = document()
    changed["animations"][0]["samplers"][0]["interpolation"] = "STEP"
    (shown,) = evaluate_gltf(write_glb(tmp_path / "a.glb", changed, ARRAYS))
    held = shown.weights_at(np.array([0, 1.9, 2, 3.9, 9]))[:, 0]
    np.testing.assert_array_equal(held, [0, 0, 1, 1, 3])


def test_nodes_place_the_mesh_and_normals_are_unit(tmp_path: Path, write_glb) -> None:
    half = float(np.sqrt(0.5))
    nodes = [
        {"mesh": 0, "translation": [0, 0, 5]},
        {"children": [0], "rotation": [0, 0, half, half], "scale": [2, 1, 1]},
    ]
    placed = document(nodes=nodes, scenes=[{"nodes": [1]}])
    (shown,) = evaluate_gltf(write_glb(tmp_path / "a.glb", placed, ARRAYS))
    at = np.array([2.0])
    np.testing.assert_allclose(
        shown.points_at(at)[0], [[0, 0, 6], [0, 2, 5], [-1, 0, 5]], atol=1e-6
    )
    normals = shown.normals_at(at)
    assert normals is not None
    np.testing.assert_allclose(normals[0], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-6)


def test_a_skin_places_the_mesh(tmp_path: Path, write_glb) -> None:
    joints = np.tile(np.array([0, 1, 0, 0], "<u2"), (4, 1))
    weights = np.tile(np.array([0.25, 0.75, 0, 0], "<f4"), (4, 1))
    inverse = np.tile(np.eye(4, dtype="<f4"), (2, 1, 1))
    inverse[1, 3, 0] = -1  # columns come first: a translation is in the last four
    skinned = document(
        nodes=[{"mesh": 0, "skin": 0}, {}, {"translation": [5, 0, 0]}],
        skins=[{"joints": [1, 2], "inverseBindMatrices": 7}],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    at = skinned["meshes"][0]["primitives"][0]["attributes"]
    at |= {"JOINTS_0": 5, "WEIGHTS_0": 6}
    arrays = [*ARRAYS, joints, weights, inverse.reshape(2, 16)]
    (shown,) = evaluate_gltf(write_glb(tmp_path / "a.glb", skinned, arrays))
    np.testing.assert_allclose(
        shown.points_at(np.zeros(1))[0], POINTS[:3] + np.array([3, 0, 0]), atol=1e-6
    )


@pytest.mark.parametrize(
    "broken",
    [
        {"nodes": [{"mesh": 3}]},
        {"nodes": [{"mesh": 0, "children": [0]}]},
        {"nodes": [{"mesh": 0, "scale": "large"}]},
        {"extensionsRequired": ["EXT_unheard_of"]},
        {"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}] * 5},
        {"bufferViews": [{"buffer": 0, "byteLength": 8}] * 5},
        {"buffers": [{"byteLength": 8, "uri": "../../other.bin"}]},
        {"meshes": 7},
    ],
)
def test_a_broken_file_is_one_line(tmp_path: Path, write_glb, broken) -> None:
    path = write_glb(tmp_path / "a.glb", document() | broken, ARRAYS)
    with pytest.raises(InputError, match="cannot be evaluated") as caught:
        evaluate_gltf(path)
    assert "\n" not in str(caught.value)


def test_no_gltf_at_all(tmp_path: Path) -> None:
    for data in (b"", b"glTF", b"{", json.dumps([]).encode()):
        (tmp_path / "a.gltf").write_bytes(data)
        with pytest.raises(InputError):
            evaluate_gltf(tmp_path / "a.gltf")
