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
