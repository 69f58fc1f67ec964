"""Avatars keep who may use them, their bones and their expressions; the rest is announced."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pygltflib import GLTF2

from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.vrm import vrm_extension
from usdface.pipeline import export_scene, import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
JOINTS = np.array([[0, 1, 0, 0]] * 3, "<u1")
WEIGHTS = np.array([[0.5, 0.5, 0, 0]] * 3, "<f4")

ONE = {
    "VRMC_vrm": {
        "specVersion": "1.0",
        "meta": {"name": "Alicia", "authors": ["A", "B"], "thumbnailImage": 3},
        "humanoid": {"humanBones": {"hips": {"node": 0}, "head": {"node": 1}}},
        "expressions": {
            "preset": {
                "happy": {
                    "isBinary": False,
                    "overrideBlink": "block",
                    "morphTargetBinds": [
                        {"node": 2, "index": 1, "weight": 0.75},
                        {"node": 2, "index": 0, "weight": 0.25},
                    ],
                },
                "blink": {},
            },
            "custom": {"ü wink": {"morphTargetBinds": [{"node": 2, "index": 0, "weight": 1}]}},
        },
    }
}
ZERO = {
    "VRM": {
        "exporterVersion": "x",
        "meta": {"title": "Alicia", "texture": 0},
        "humanoid": {"humanBones": [{"bone": "hips", "node": 0}, {"bone": "head", "node": 1}]},
        "blendShapeMaster": {
            "blendShapeGroups": [
                {
                    "name": "Joy",
                    "presetName": "joy",
                    "isBinary": True,
                    "binds": [{"mesh": 0, "index": 1, "weight": 75}],
                }
            ]
        },
    }
}


def avatar(extensions: dict[str, Any]) -> dict[str, Any]:
    primitive = {
        "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2},
        "targets": [{"POSITION": 3}, {"POSITION": 4}],
    }
    return {
        "extensionsUsed": list(extensions),
        "extensions": extensions,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"name": "Hips", "children": [1]},
            {"name": "Head", "translation": [0, 1, 0]},
            {"name": "Face", "mesh": 0, "skin": 0},
        ],
        "skins": [{"joints": [0, 1]}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["a", "ö"]}}],
    }


def write(write_glb: Any, path: Path, extensions: dict[str, Any]) -> Path:
    arrays = [POINTS, JOINTS, WEIGHTS, 0.1 * POINTS, POINTS[::-1] * 0.2]
    return write_glb(path, avatar(extensions), [np.ascontiguousarray(a) for a in arrays])


def json_of(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def there_and_back(folder: Path, path: Path) -> tuple[dict[str, Any], list[Any]]:
    found = import_scene(path, folder / "a.usda").findings
    export_scene(folder / "a.usda", folder / "b.glb")
    return json_of(folder / "b.glb"), [f for f in found if f.severity != "info"]


def named(document: dict[str, Any], node: int) -> str:
    return document["nodes"][node]["name"]


def test_version_1_there_and_back(write_glb, tmp_path: Path, validate_gltf) -> None:
    back, found = there_and_back(tmp_path, write(write_glb, tmp_path / "a.vrm", ONE))
    assert [(f.code, f.where) for f in found] == [("EXTENSION_DROPPED", "VRMC_vrm")]
    assert "thumbnailImage" in found[0].message
    made = back["extensions"]["VRMC_vrm"]
    assert back["extensionsUsed"] == ["VRMC_vrm"]
    assert made["meta"] == {"name": "Alicia", "authors": ["A", "B"]}
    bones = made["humanoid"]["humanBones"]
    assert {b: named(back, n["node"]) for b, n in bones.items()} == {"hips": "Hips", "head": "Head"}
    happy = made["expressions"]["preset"]["happy"]
    binds = {(named(back, b["node"]), b["index"]): b["weight"] for b in happy["morphTargetBinds"]}
    assert binds == {("Face", 0): 0.25, ("Face", 1): 0.75}
    assert happy["overrideBlink"] == "block" and happy["isBinary"] is False
    assert made["expressions"]["preset"]["blink"] == {}
    assert list(made["expressions"]["custom"]) == ["ü wink"]
    assert validate_gltf(tmp_path / "b.glb")["issues"]["numErrors"] == 0


def test_version_0_there_and_back(write_glb, tmp_path: Path) -> None:
    back, found = there_and_back(tmp_path, write(write_glb, tmp_path / "a.vrm", ZERO))
    assert [(f.code, f.where) for f in found] == [("EXTENSION_DROPPED", "VRM")]
    made = back["extensions"]["VRM"]
    bones = {b["bone"]: named(back, b["node"]) for b in made["humanoid"]["humanBones"]}
    assert bones == {"hips": "Hips", "head": "Head"}
    (joy,) = made["blendShapeMaster"]["blendShapeGroups"]
    expected = {"name": "Joy", "presetName": "joy", "isBinary": True}
    assert joy == expected | {"binds": [{"mesh": 0, "index": 1, "weight": 75.0}]}


def test_what_else_an_avatar_holds_is_announced(write_glb, tmp_path: Path) -> None:
    more = ONE["VRMC_vrm"] | {"hats": {}}
    path = write(write_glb, tmp_path / "a.vrm", {"VRMC_vrm": more, "VRMC_hats": {}})
    found = {f.where: f.message for f in read_gltf(path)[2] if f.code == "EXTENSION_DROPPED"}
    assert "hats" in found["VRMC_vrm"]
    assert found["VRMC_hats"] == "its data are left out: the file"


@pytest.mark.parametrize("name", ["VRM", "VRMC_vrm"])
def test_a_bone_that_is_no_joint_is_announced(write_glb, tmp_path: Path, name: str) -> None:
    bones = {"hips": {"node": 0}, "head": {"node": 2}}  # which carries the mesh
    listed = [{"bone": bone, **node} for bone, node in bones.items()]
    more = {"humanoid": {"humanBones": listed if name == "VRM" else bones}}
    path = write(write_glb, tmp_path / "a.vrm", {name: (ONE | ZERO)[name] | more})
    rig, _, found = read_gltf(path)
    assert rig.asset["vrm"]["humanoid"] == {"hips": "Hips"}
    given = [f.message for f in found if f.where == name]
    assert any(m.startswith(f"head of {name} are left out: the bones are no joints") for m in given)


def two_faces(write_glb: Any, path: Path, extensions: dict[str, Any]) -> Path:
    """An avatar of two meshes whose nodes share a name."""
    document = avatar(extensions)
    document["nodes"].append({"name": "Face", "mesh": 1, "skin": 0})
    document["scenes"][0]["nodes"].append(3)
    document["meshes"].append(document["meshes"][0])
    arrays = [POINTS, JOINTS, WEIGHTS, 0.1 * POINTS, POINTS[::-1] * 0.2]
    return write_glb(path, document, [np.ascontiguousarray(a) for a in arrays])


def test_meshes_of_one_name_keep_their_own_binds(write_glb, tmp_path: Path) -> None:
    binds = {
        "happy": [{"node": 3, "index": 1, "weight": 0.5}],
        "sad": [{"node": 2, "index": 0, "weight": 1}],
    }
    custom = {name: {"morphTargetBinds": rows} for name, rows in binds.items()}
    given = ONE["VRMC_vrm"] | {"expressions": {"custom": custom}}
    back, _ = there_and_back(
        tmp_path, two_faces(write_glb, tmp_path / "a.vrm", {"VRMC_vrm": given})
    )
    made = back["extensions"]["VRMC_vrm"]["expressions"]["custom"]
    first, second = (k for k, node in enumerate(back["nodes"]) if node["name"] == "Face")
    assert made["happy"]["morphTargetBinds"] == [{"node": second, "index": 1, "weight": 0.5}]
    assert made["sad"]["morphTargetBinds"] == [{"node": first, "index": 0, "weight": 1.0}]


def test_expressions_of_one_name_all_come_back(write_glb, tmp_path: Path) -> None:
    kinds = {
        kind: {"happy": {"morphTargetBinds": [{"node": 2, "index": index, "weight": 1}]}}
        for index, kind in enumerate(("preset", "custom"))
    }
    given = {"VRMC_vrm": ONE["VRMC_vrm"] | {"expressions": kinds}}
    back, _ = there_and_back(tmp_path, write(write_glb, tmp_path / "a.vrm", given))
    made = back["extensions"]["VRMC_vrm"]["expressions"]
    places = {kind: made[kind]["happy"]["morphTargetBinds"][0]["index"] for kind in made}
    assert places == {"preset": 0, "custom": 1}


def test_what_else_expressions_and_bones_hold_is_announced(write_glb, tmp_path: Path) -> None:
    happy = {
        "morphTargetBinds": [{"node": 2, "index": 9, "weight": 1}],
        "materialColorBinds": [{"material": 0, "type": "color", "targetValue": [1, 0, 0, 1]}],
        "textureTransformBinds": [],
    }
    one = {"VRMC_vrm": ONE["VRMC_vrm"] | {"expressions": {"preset": {"happy": happy}}}}
    joy = {
        "name": "Joy",
        "binds": [{"mesh": 7, "index": 0, "weight": 100}],
        "materialValues": [{"materialName": "Skin", "targetValue": [1, 0, 0, 1]}],
    }
    bones = [{"bone": "hips", "node": 0, "useDefaultValues": False, "min": {"x": -10}}]
    zero = {
        "VRM": {
            "humanoid": {"humanBones": bones, "armStretch": 0.1},
            "blendShapeMaster": {"blendShapeGroups": [joy]},
        }
    }
    for extensions, unbound, lost in (
        (one, "happy", ["materialColorBinds", "thumbnailImage"]),
        (zero, "Joy", ["armStretch", "materialValues", "min"]),
    ):
        found = read_gltf(write(write_glb, tmp_path / "a.vrm", extensions))[2]
        parts = [f.values["parts"] for f in found if f.code == "EXTENSION_DROPPED"]
        assert parts == [[unbound], lost]


def test_bones_whose_joints_are_not_written_are_announced() -> None:
    avatar = {"version": "1.0", "humanoid": {"hips": "Hips", "head": "Hips/Head"}}
    name, content, found = vrm_extension(avatar, [], {"Hips": 3}, GLTF2())
    assert content["humanoid"] == {"humanBones": {"hips": {"node": 3}}}
    assert [(f.code, f.where, f.values["parts"]) for f in found] == [
        ("EXTENSION_DROPPED", name, ["head"])
    ]


def test_binds_whose_blend_shapes_are_not_written_are_announced() -> None:
    expressions = {"joy": {"weights": {"Face": {"a": 1.0}}}, "calm": {}}
    _, content, found = vrm_extension({"expressions": expressions}, [], {}, GLTF2())
    assert content["expressions"] == {"custom": {"joy": {}, "calm": {}}}
    assert [(f.code, f.values["parts"]) for f in found] == [("EXTENSION_DROPPED", ["joy"])]


def test_springs_of_what_is_no_avatar_are_announced(write_glb, tmp_path: Path) -> None:
    path = write(write_glb, tmp_path / "a.glb", {"VRMC_springBone": {}})
    assert "VRMC_springBone" in {f.where for f in read_gltf(path)[2]}


@pytest.mark.parametrize(
    "part",
    [
        *("root", "asset", "node", "mesh", "primitive", "scene", "skin"),
        *("accessor", "view", "buffer", "camera", "lens", "texture", "texture info", "image"),
        *("sampler", "animation", "channel", "target", "curve"),
    ],
)
def test_unknown_extensions_of_every_part_are_announced(write_glb, tmp_path, part: str) -> None:
    document = avatar({}) | {
        "asset": {"version": "2.0"},
        "accessors": [
            {"bufferView": k, "componentType": c, "count": 3, "type": t}
            for k, (c, t) in enumerate(
                [
                    *((5126, "VEC3"), (5121, "VEC4"), (5126, "VEC4"), (5126, "VEC3")),
                    *((5126, "VEC3"), (5126, "SCALAR"), (5126, "VEC3")),
                ]
            )
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "materials": [{"name": "m", "normalTexture": {"index": 0}}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{}],
        "images": [{"uri": "none.png"}],
        "animations": [
            {
                "samplers": [{"input": 5, "output": 6}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
            }
        ],
    }
    document["bufferViews"] = [
        {"buffer": 0, "byteOffset": at, "byteLength": size}
        for at, size in ((0, 36), (36, 12), (48, 48), (96, 36), (132, 36), (168, 12), (180, 36))
    ]
    document["buffers"] = [{"byteLength": 216}]
    document["nodes"][1]["camera"] = 0
    animation = document["animations"][0]
    places = {
        "asset": document["asset"],
        "accessor": document["accessors"][0],
        "view": document["bufferViews"][0],
        "buffer": document["buffers"][0],
        "camera": document["cameras"][0],
        "lens": document["cameras"][0]["perspective"],
        "texture": document["textures"][0],
        "texture info": document["materials"][0]["normalTexture"],
        "image": document["images"][0],
        "sampler": document["samplers"][0],
        "animation": animation,
        "channel": animation["channels"][0],
        "target": animation["channels"][0]["target"],
        "curve": animation["samplers"][0],
        "root": document,
        "node": document["nodes"][0],
        "mesh": document["meshes"][0],
        "primitive": document["meshes"][0]["primitives"][0],
        "scene": document["scenes"][0],
        "skin": document["skins"][0],
    }
    places[part]["extensions"] = {"ACME_x": {"y": 1}}
    times = np.array([0, 1, 2], "<f4")
    arrays = [POINTS, JOINTS, WEIGHTS, 0.1 * POINTS, 0.2 * POINTS, times, POINTS]
    done = import_scene(write_glb(tmp_path / "a.glb", document, arrays), tmp_path / "a.usda")
    assert [f.where for f in done.findings if f.code == "EXTENSION_DROPPED"] == ["ACME_x"]


def test_instances_of_a_skin_are_counted(write_glb, tmp_path: Path) -> None:
    document = avatar({})
    instancing = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 5}}}
    document["nodes"][2]["extensions"] = instancing
    arrays = [POINTS, JOINTS, WEIGHTS, 0.1 * POINTS, 0.2 * POINTS, np.zeros((2500, 3), "<f4")]
    _, _, found = read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
    result = {f.where: f.message for f in found if f.severity == "warning"}
    assert result["EXT_mesh_gpu_instancing"].startswith("2500 instances of node 2")
