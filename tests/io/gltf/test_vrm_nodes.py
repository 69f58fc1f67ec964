"""Spring bones, constraints, first person and gaze of avatars name the same nodes again."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pygltflib import GLTF2, Node

from usdface.io.gltf.vrm_nodes import NamedNodes, read_vrm_nodes, write_vrm_nodes
from usdface.pipeline import export_scene, import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
JOINTS = np.array([[0, 1, 0, 0]] * 3, "<u1")
WEIGHTS = np.array([[0.5, 0.5, 0, 0]] * 3, "<f4")
BONES = {"humanBones": {"hips": {"node": 0}, "head": {"node": 1}}}
SPRINGS = {
    "specVersion": "1.0",
    "colliders": [{"node": 1, "shape": {"sphere": {"offset": [0, 0.1, 0], "radius": 0.1}}}],
    "colliderGroups": [{"name": "head", "colliders": [0]}],
    "springs": [
        {
            "name": "hair",
            "joints": [
                {"node": 3, "hitRadius": 0.02, "stiffness": 1.0, "gravityDir": [0, -1, 0]},
                {"node": 4},
            ],
            "colliderGroups": [0],
            "center": 0,
        }
    ],
}
FIRST = {"meshAnnotations": [{"node": 2, "type": "thirdPersonOnly"}]}
GAZE = {"type": "bone", "offsetFromHeadBone": [0, 0.06, 0]}
ONE = {
    "VRMC_vrm": {
        "specVersion": "1.0",
        "meta": {"name": "A"},
        "humanoid": BONES,
        "firstPerson": FIRST,
        "lookAt": GAZE,
    },
    "VRMC_springBone": SPRINGS,
}
ZERO = {
    "VRM": {
        "meta": {"title": "A"},
        "humanoid": {"humanBones": [{"bone": "hips", "node": 0}, {"bone": "head", "node": 1}]},
        "firstPerson": {
            "firstPersonBone": 1,
            "meshAnnotations": [{"mesh": 0, "firstPersonFlag": "Auto"}],
        },
        "secondaryAnimation": {
            "boneGroups": [{"bones": [3], "center": -1, "dragForce": 0.4, "colliderGroups": [0]}],
            "colliderGroups": [{"node": 1, "colliders": [{"radius": 0.1}]}],
        },
    }
}
ROLL = {"specVersion": "1.0", "constraint": {"roll": {"source": 4, "rollAxis": "Y", "weight": 0.5}}}


def avatar(extensions: dict[str, Any]) -> dict[str, Any]:
    skinned = {"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}
    return {
        "extensionsUsed": [*extensions, "VRMC_node_constraint"],
        "extensions": extensions,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"name": "Hips", "children": [1]},
            {"name": "Head", "translation": [0, 1, 0], "children": [3]},
            {"name": "Face", "mesh": 0, "skin": 0},
            {"name": "Hair", "children": [4], "translation": [0, 0.1, 0]},
            {"name": "Hair end", "translation": [0, 0.1, 0]},
        ],
        "skins": [{"joints": [0, 1]}],
        "meshes": [{"name": "Face mesh", "primitives": [skinned]}],
    }


def json_of(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def by_name(document: dict[str, Any], value: Any, key: str = "") -> Any:
    """Nodes and meshes as their names."""
    if isinstance(value, dict):
        return {k: by_name(document, v, k) for k, v in value.items()}
    if isinstance(value, list):
        return [by_name(document, v, key) for v in value]
    if key in ("node", "center", "source", "firstPersonBone", "bones") and value >= 0:
        return document["nodes"][value]["name"]
    if key == "mesh":
        return next(n["name"] for n in document["nodes"] if n.get("mesh") == value)
    return value


@pytest.mark.parametrize("extensions", [ZERO, ONE])
def test_there_and_back(write_glb, tmp_path: Path, validate_gltf, extensions: Any) -> None:
    document = avatar(extensions)
    document["nodes"][3]["extensions"] = {"VRMC_node_constraint": ROLL}
    source = write_glb(tmp_path / "a.vrm", document, [POINTS, JOINTS, WEIGHTS])
    there = import_scene(source, tmp_path / "a.usda")
    back = export_scene(tmp_path / "a.usda", tmp_path / "b.glb")
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    written = json_of(tmp_path / "b.glb")
    for name, content in extensions.items():
        for part in set(content) - {"humanoid", "meta", "specVersion"}:
            expected = by_name(document, content[part])
            assert by_name(written, written["extensions"][name][part]) == expected
    hair = next(node for node in written["nodes"] if node["name"] == "Hair")
    assert by_name(written, hair["extensions"]["VRMC_node_constraint"]) == by_name(document, ROLL)
    assert {*written["extensionsUsed"]} == {*extensions, "VRMC_node_constraint"}
    assert validate_gltf(tmp_path / "b.glb")["issues"]["numErrors"] == 0


def test_a_part_that_names_what_is_not_kept_is_left_out_loudly(write_glb, tmp_path: Path) -> None:
    extensions = ONE | {"VRMC_springBone": {"springs": [{"joints": [{"node": 77}]}]}}
    source = write_glb(tmp_path / "a.vrm", avatar(extensions), [POINTS, JOINTS, WEIGHTS])
    found = import_scene(source, tmp_path / "a.usda").findings
    assert [f.where for f in found if f.code == "EXTENSION_DROPPED"] == ["VRMC_springBone"]


@pytest.mark.parametrize(
    "constraints", ["5", "[5]", '{"a": 1}', '[{"node": {"joint": "a"}}]', '[{"node": "x"}]']
)
def test_constraints_that_are_none_are_left_out_loudly(constraints: str) -> None:
    """They come from customData, which anyone may have written."""
    document = GLTF2(nodes=[Node()], extensions={"VRMC_vrm": {}})
    nodes = NamedNodes({"joint": {"a": 0}})
    found = write_vrm_nodes({"constraints": constraints}, "VRMC_vrm", nodes, document)
    assert [one.code for one in found] == ["EXTENSION_DROPPED"]
    assert not document.nodes[0].extensions


def test_a_part_that_is_nested_too_deep_is_left_out_loudly() -> None:
    deep: Any = []
    for _ in range(2000):
        deep = [deep]
    document = GLTF2(nodes=[], extensions={"VRMC_springBone": {"springs": deep}})
    parts, found = read_vrm_nodes(document, NamedNodes({}))
    assert parts == {} and [one.code for one in found] == ["EXTENSION_DROPPED"]


def test_a_part_whose_bone_was_deleted_in_usd_is_left_out_loudly(write_glb, tmp_path: Path) -> None:
    source = write_glb(tmp_path / "a.vrm", avatar(ONE), [POINTS, JOINTS, WEIGHTS])
    import_scene(source, tmp_path / "a.usda")
    text = (tmp_path / "a.usda").read_text()
    (tmp_path / "a.usda").write_text(text.replace('def Xform "Hair"', 'def Scope "Hair"'))
    back = export_scene(tmp_path / "a.usda", tmp_path / "b.glb")
    assert "EXTENSION_DROPPED" in {f.code for f in back.findings}
    assert "VRMC_springBone" not in json_of(tmp_path / "b.glb")["extensions"]
