from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.textures import uv_name
from usdface.rigs import Mesh, Rig

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")


def read_primitives(write_glb, path: Path, arrays: list, *primitives: dict, **mesh: object):
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": list(primitives), **mesh}],
        "materials": [{"name": "red"}, {"name": "blue"}],
    }
    return read_gltf(write_glb(path / "a.glb", document, arrays))


def corners_of(mesh: Mesh) -> list[list[float]]:
    return mesh.points[mesh.face_indices].tolist()


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (None, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (4, None, [[0, 1, 2]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (5, None, [[0, 1, 2], [1, 3, 2]]),
        (6, None, [[0, 1, 2], [0, 2, 3]]),
        (6, [3, 0, 1, 2], [[3, 0, 1], [3, 1, 2]]),
    ],
)
def test_modes(write_glb, tmp_path: Path, mode, indices, expected) -> None:
    primitive = {"attributes": {"POSITION": 0}} | ({} if mode is None else {"mode": mode})
    arrays = [SQUARE]
    if indices is not None:
        primitive["indices"] = 1
        arrays.append(np.array(indices, "<u2"))
    rig, _, found = read_primitives(write_glb, tmp_path, arrays, primitive)
    mesh = rig.meshes[0]
    np.testing.assert_array_equal(mesh.face_counts, [3] * len(expected))
    assert corners_of(mesh) == SQUARE[np.ravel(expected)].tolist()
    assert found == []


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_points_and_lines_are_left_out(write_glb, tmp_path: Path, mode: int) -> None:
    drawn = {"attributes": {"POSITION": 0}, "mode": mode}
    with pytest.raises(InputError, match=r"no mesh with triangles to read: .*points and lines"):
        read_primitives(write_glb, tmp_path, [SQUARE], drawn)
    whole = {"attributes": {"POSITION": 0}}
    rig, _, found = read_primitives(write_glb, tmp_path, [SQUARE], drawn, whole)
    assert len(rig.meshes) == 1
    assert {f.code for f in found} == {"FEATURE_DROPPED"}


def test_borders_between_materials_and_texture_seams_close(write_glb, tmp_path: Path) -> None:
    left, right = SQUARE[[0, 1, 2]], SQUARE[[0, 2, 3]]
    uv = np.random.default_rng(0).random((6, 2)).astype("<f4")
    delta = np.zeros((4, 3), "<f4")
    delta[[0, 2]] = [[0, 0, 1], [0, 0, 2]]
    arrays = [left, uv[:3], delta[[0, 1, 2]], right, uv[3:], delta[[0, 2, 3]]]
    rig, _, _ = read_primitives(
        write_glb,
        tmp_path,
        arrays,
        {
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1},
            "targets": [{"POSITION": 2}],
            "material": 1,
        },
        {
            "attributes": {"POSITION": 3, "TEXCOORD_0": 4},
            "targets": [{"POSITION": 5}],
            "material": 0,
        },
    )
    mesh = rig.meshes[0]
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_array_equal(mesh.face_indices, [0, 1, 2, 0, 2, 3])
    np.testing.assert_allclose(mesh.uvs, np.stack([uv[:, 0], 1 - uv[:, 1]], 1), atol=1e-7)
    assert [(s.material, s.faces.tolist()) for s in mesh.subsets] == [("blue", [0]), ("red", [1])]
    np.testing.assert_array_equal(mesh.shapes[0].indices, [0, 2])
    np.testing.assert_array_equal(mesh.shapes[0].offsets, [[0, 0, 1], [0, 0, 2]])


def test_lips_that_touch_but_part_stay_two(write_glb, tmp_path: Path) -> None:
    points = np.concatenate([SQUARE[:3], SQUARE[:3]])
    delta = np.zeros((6, 3), "<f4")
    delta[3:] = [0, -1, 0]
    rig, _, _ = read_primitives(
        write_glb,
        tmp_path,
        [points, delta],
        {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]},
    )
    assert len(rig.meshes[0].points) == 6


def test_one_material_needs_no_subset(write_glb, tmp_path: Path) -> None:
    rig, _, _ = read_primitives(
        write_glb, tmp_path, [SQUARE], {"attributes": {"POSITION": 0}, "material": 1, "mode": 6}
    )
    assert rig.meshes[0].material == "blue"
    assert rig.meshes[0].subsets == ()


def test_targets_with_normals(write_glb, tmp_path: Path) -> None:
    up = np.tile(np.array([0, 0, 2], "<f4"), (4, 1))
    move, turn = np.zeros((4, 3), "<f4"), np.zeros((4, 3), "<f4")
    move[1], turn[2] = (1, 2, 3), (0.5, 0, 0)
    rig, _, _ = read_primitives(
        write_glb,
        tmp_path,
        [SQUARE, up, move, turn],
        {
            "attributes": {"POSITION": 0, "NORMAL": 1},
            "mode": 6,
            "targets": [{"POSITION": 2, "NORMAL": 3}, {"NORMAL": 3}, {}],
        },
        extras={"targetNames": ["jaw open", "口", ""]},
    )
    mesh = rig.meshes[0]
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (4, 1)))
    assert mesh.shape_names == ("jaw open", "口", "target_2")
    both, turning, nothing = mesh.shapes
    np.testing.assert_array_equal(both.indices, [1, 2])
    np.testing.assert_array_equal(both.offsets, [[1, 2, 3], [0, 0, 0]])
    np.testing.assert_array_equal(both.normal_offsets, [[0, 0, 0], [0.5, 0, 0]])
    np.testing.assert_array_equal(turning.indices, [2])
    assert len(nothing.indices) == 0


@pytest.mark.parametrize(
    ("given", "expected", "codes"),
    [
        (["a", "a"], ("a", "a_2"), ["NAME_CHANGED"]),
        (["a_2", "a"], ("a_2", "a"), []),
        (["a"], ("a", "target_1"), ["NAME_CHANGED"]),
        (["a", "b", "c"], ("a", "b"), ["NAME_CHANGED"]),
        ([], ("target_0", "target_1"), ["SHAPE_NAMES_ASSUMED"]),
        ("ab", ("target_0", "target_1"), ["SHAPE_NAMES_ASSUMED"]),
        ([1, 2], ("target_0", "target_1"), ["SHAPE_NAMES_ASSUMED"]),
        (["\ud800", "?"], ("?", "?_2"), ["NAME_CHANGED"]),
    ],
)
def test_target_names(write_glb, tmp_path: Path, given, expected, codes) -> None:
    rig, _, found = read_primitives(
        write_glb,
        tmp_path,
        [SQUARE, SQUARE],
        {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}] * 2},
        extras={"targetNames": given},
    )
    assert rig.shape_names == expected
    assert [f.code for f in found] == codes


def named_targets(write_glb, path: Path, names: dict[str, list[str]]) -> tuple[Rig, list[Finding]]:
    """Read a mesh with two targets, named by the extras of some of its parts or by accessors."""
    primitive: dict[str, Any] = {
        "attributes": {"POSITION": 0},
        "targets": [{"POSITION": 1}, {"POSITION": 2}],
    }
    node: dict[str, Any] = {"mesh": 0}
    mesh: dict[str, Any] = {"primitives": [primitive]}
    parts = {"mesh": mesh, "primitive": primitive, "node": node}
    for part in parts.keys() & names.keys():
        parts[part]["extras"] = {"targetNames": names[part]}
    document: dict[str, Any] = {"scenes": [{"nodes": [0]}], "nodes": [node], "meshes": [mesh]}
    if "accessors" in names:
        kind = {"componentType": 5126, "count": 4, "type": "VEC3"}
        document["bufferViews"] = [
            {"buffer": 0, "byteOffset": 48 * k, "byteLength": 48} for k in range(3)
        ]
        document["accessors"] = [
            kind | {"bufferView": k, "name": name}
            for k, name in enumerate(["points", *names["accessors"]])
        ]
    rig, _, found = read_gltf(write_glb(path / "a.glb", document, [SQUARE] * 3))
    return rig, found


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ({"primitive": ["jaw", "口"]}, ("jaw", "口")),  # UniVRM
        ({"node": ["jaw", "smile"]}, ("jaw", "smile")),
        ({"mesh": ["jaw", "smile"], "primitive": ["a", "b"], "node": ["c", "d"]}, ("jaw", "smile")),
        ({"mesh": [], "primitive": ["jaw", "smile"]}, ("jaw", "smile")),
    ],
)
def test_names_of_targets_may_stand_on_primitives_and_nodes(
    write_glb, tmp_path: Path, names, expected
) -> None:
    rig, found = named_targets(write_glb, tmp_path, names)
    assert rig.shape_names == expected
    assert found == []


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["jaw", "smile"], ("jaw", "smile")),
        (["positions", "positions"], ("target_0", "target_1")),
        (["jaw", ""], ("target_0", "target_1")),
    ],
)
def test_names_of_accessors_stand_for_those_of_targets(
    write_glb, tmp_path: Path, names, expected
) -> None:
    rig, found = named_targets(write_glb, tmp_path, {"accessors": names})
    assert rig.shape_names == expected
    assert [f.code for f in found] == ["SHAPE_NAMES_ASSUMED", "NAME_DROPPED"]
    lost = [name for name in dict.fromkeys(["points", *names]) if name and name not in expected]
    assert found[1].values["names"] == lost


def test_attributes_behind_a_gap_are_announced(write_glb, tmp_path: Path) -> None:
    """Sets of texture coordinates and joints count from 0; what is behind a gap is not read."""
    pairs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "<f4")
    shares = np.tile(np.array([1, 0, 0, 0], "<f4"), (4, 1))
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_2": 1, "WEIGHTS_0": 2, "COLOR_1": 2}
    rig, _, found = read_primitives(
        write_glb, tmp_path, [SQUARE, pairs, shares], {"attributes": attributes}
    )
    assert rig.meshes[0].uvs is not None
    assert [f.values["attribute"] for f in found] == ["COLOR_1", "TEXCOORD_2", "WEIGHTS_0"]


def test_quantised_meshes(write_glb, tmp_path: Path) -> None:
    points = np.array([[0, 0, 0, 0], [10, 0, 0, 0], [0, 20, 0, 0]], "<i2")  # padded to 8 bytes
    delta = np.array([[1, 2, 3, 0]] * 3, "<i1")
    document = {
        "extensionsRequired": ["KHR_mesh_quantization"],
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [0.1, 0.1, 0.1], "translation": [0, 0, 5]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}]}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 24, "byteStride": 8},
            {"buffer": 0, "byteOffset": 24, "byteLength": 12, "byteStride": 4},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5120, "count": 3, "type": "VEC3"},
        ],
    }
    rig, _, _ = read_gltf(write_glb(tmp_path / "a.glb", document, [points, delta]))
    np.testing.assert_allclose(rig.meshes[0].points, [[0, 0, 5], [1, 0, 5], [0, 2, 5]])
    np.testing.assert_allclose(rig.meshes[0].shapes[0].offsets, [[0.1, 0.2, 0.3]] * 3)


@pytest.mark.parametrize(
    "primitives",
    [
        [{"attributes": {"POSITION": 0}, "indices": 2}],  # points to vertex 9
        [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}],  # 3 for 4 vertices
        [{"attributes": {"POSITION": 0, "NORMAL": 1}}],
        [{"attributes": {"POSITION": 0, "JOINTS_0": 3}}],  # without weights
        [{"attributes": {"POSITION": 0}, "material": 2}],
        [{"attributes": {"POSITION": 0}, "material": -1}],
        [{"attributes": {"POSITION": 7}}],
        [
            {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]},
            {"attributes": {"POSITION": 0}, "targets": []},
        ],
    ],
)
def test_what_does_not_fit_together_is_refused(write_glb, tmp_path: Path, primitives) -> None:
    arrays = [SQUARE, SQUARE[:3], np.array([0, 1, 9], "<u1"), np.zeros((4, 4), "<u1")]
    with pytest.raises(InputError, match=r"a\.glb: "):
        read_primitives(write_glb, tmp_path, arrays, *primitives)


def test_attributes_that_are_not_read_are_announced(write_glb, tmp_path: Path) -> None:
    _, _, found = read_primitives(
        write_glb, tmp_path, [SQUARE], {"attributes": {"POSITION": 0, "COLOR_1": 0, "_X": 0}}
    )
    assert [f.message.split()[2] for f in found] == ["COLOR_1", "_X"]


def test_a_set_of_coordinates_that_another_program_added_has_its_own_name(
    write_glb, tmp_path: Path
) -> None:
    assert uv_name(1, ["st1"]) == "st1_1"  # with two of a name the reader never ended
    document = {
        # Of an export whose one set was called st1; the lightmap came later.
        "asset": {"version": "2.0", "extras": {"usdface": {"uvNames": ["st1"]}}},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2}}]}
        ],
    }
    sets = [SQUARE[:, :2], SQUARE[:, :2] / 2]
    mesh = read_gltf(write_glb(tmp_path / "a.glb", document, [SQUARE, *sets]))[0].meshes[0]
    assert list(mesh.uv_sets) == ["st1", "st1_1"]
    np.testing.assert_array_equal(2 * mesh.uv_sets["st1_1"][:, 0], mesh.uv_sets["st1"][:, 0])
