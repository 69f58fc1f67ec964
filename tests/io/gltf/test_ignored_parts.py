from pathlib import Path

import numpy as np

from usdface.io.gltf.read import read_gltf


def test_parts_that_no_node_has_are_announced(write_glb, tmp_path: Path) -> None:
    mesh = {"primitives": [{"attributes": {"POSITION": 0}}]}
    lens = {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}
    lights = [{"type": "point", "name": "key"}, {"type": "point", "name": "rim"}]
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 1, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [mesh | {"name": "LOD1"}, mesh, mesh],
        "cameras": [lens],
        "textures": [{"source": 0}],
        "images": [{"uri": "spare.png"}],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
    }
    rig, _, found = read_gltf(write_glb(tmp_path / "x.glb", document, [np.eye(3, dtype="<f4")]))
    assert len(rig.meshes) == len(rig.lights) == 1
    assert [(f.code, f.where, f.values["names"]) for f in found] == [
        ("FEATURE_DROPPED", "mesh", ["LOD1", "mesh 2"]),
        ("FEATURE_DROPPED", "camera", ["camera 0"]),
        ("FEATURE_DROPPED", "light", ["rim"]),
        ("FEATURE_DROPPED", "image", ["image 0"]),
    ]


def test_names_without_a_place_are_announced(write_glb, tmp_path: Path) -> None:
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}], "name": "part"}
    array = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    document = {
        "nodes": [{"mesh": 0, "name": "a"}, {"name": "neck"}],
        "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": [1], "name": name} for name in ("body", "body", "hair")],
        "samplers": [{"name": "nearest"}],
        "accessors": [array | {"name": "smile"}, array | {"name": "unused"}],
    }
    rig, _, found = read_gltf(write_glb(tmp_path / "x.glb", document, [np.eye(3, dtype="<f4")]))
    assert rig.shape_names == ("smile",)
    assert {f.where: f.values["names"] for f in found if f.code == "NAME_DROPPED"} == {
        "meshes": ["part"],
        "skins": ["hair"],
        "samplers": ["nearest"],
        "accessors": ["unused"],
    }


def test_half_of_a_skin_is_announced(write_glb, tmp_path: Path) -> None:
    influences = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    document = {
        "nodes": [
            {"mesh": 0, "name": "both", "skin": 0},
            {"mesh": 0, "name": "still"},
            {"mesh": 1, "name": "bare", "skin": 0},
            {"name": "joint"},
        ],
        "meshes": [
            {"primitives": [{"attributes": attributes}]}
            for attributes in (influences, {"POSITION": 0})
        ],
        "skins": [{"joints": [3]}],
    }
    arrays = [np.eye(3, dtype="<f4"), np.zeros((3, 4), "u1"), np.eye(4, dtype="<f4")[[0, 0, 0]]]
    rig, _, found = read_gltf(write_glb(tmp_path / "x.glb", document, arrays))
    assert [mesh.skin is not None for mesh in rig.meshes] == [True, False, False]
    lost = {f.where: f.message for f in found if f.values.get("feature") == "skin"}
    assert lost == {
        "still": "influences of joints are left out, as its node has no skin",
        "bare": "the skin of its node is left out, as it has no influences of joints",
    }


def test_extras_of_another_scene_are_announced(write_glb, tmp_path: Path) -> None:
    document = {
        "scenes": [{"nodes": [0], "extras": {"kept": 1}}, {"nodes": [0], "extras": {"lost": 1}}],
        "nodes": [{"mesh": 0, "name": "a"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    path = write_glb(tmp_path / "x.glb", document, [np.eye(3, dtype="<f4")])
    rig, _, found = read_gltf(path)
    assert rig.extras == {"kept": 1}
    assert [f.message for f in found if f.code == "FEATURE_DROPPED"] == [
        "extras of scene 1 are left out"
    ]


def test_pivots_of_meshes_without_a_joint_are_announced(write_glb, tmp_path: Path) -> None:
    document = {
        "nodes": [
            {"name": "socket", "translation": [0, 1, 0], "children": [1]},
            {"mesh": 0, "name": "eye"},
            {"mesh": 0, "name": "head"},
            {"name": "jaw", "translation": [0, 2, 0], "children": [4]},
            {"mesh": 0, "name": "teeth"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "skins": [{"joints": [3]}],
    }
    path = write_glb(tmp_path / "x.glb", document, [np.eye(3, dtype="<f4")])
    _, _, found = read_gltf(path)
    assert [f.values["meshes"] for f in found if f.code == "PIVOTS_DROPPED"] == [["eye"]]
    write_glb(
        path, document | {"extensionsUsed": ["KHR_mesh_quantization"]}, [np.eye(3, dtype="<f4")]
    )
    assert "PIVOTS_DROPPED" not in [f.code for f in read_gltf(path)[2]]


def test_extras_that_a_node_and_its_mesh_both_have_are_announced(write_glb, tmp_path: Path) -> None:
    """As Blender writes properties of an object and of its data."""
    document = {
        "nodes": [{"mesh": 0, "name": "a", "extras": {"age": 4, "same": 1}}],
        "meshes": [
            {
                "primitives": [{"attributes": {"POSITION": 0}}],
                "extras": {"age": 3, "same": 1, "own": 2},
            }
        ],
    }
    path = write_glb(tmp_path / "x.glb", document, [np.eye(3, dtype="<f4")])
    rig, _, found = read_gltf(path)
    assert rig.meshes[0].extras == {"age": 4, "same": 1, "own": 2}
    assert [f.values["names"] for f in found if f.code == "FEATURE_DROPPED"] == [["age"]]
