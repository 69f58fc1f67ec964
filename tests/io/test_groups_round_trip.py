"""Groups, bones without skin and their extras go from glTF to USD and back."""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from usdface.io.gltf.document import load_document
from usdface.io.gltf.nodes import node_tree
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.options import ExportOptions
from usdface.pipeline import export_scene, import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
JOINTS = np.array([[0, 1, 0, 0]] * 3, "<u1")
WEIGHTS = np.array([[0.5, 0.5, 0, 0]] * 3, "<f4")
TURN = [0.5, 0.5, 0.5, 0.5]


def scene() -> dict[str, Any]:
    skinned = {"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}
    return {
        "scenes": [{"nodes": [0, 3]}],
        "nodes": [
            {"name": "Armature", "children": [1, 2], "scale": [2, 2, 2], "extras": {"rig": "b"}},
            {"name": "Hips", "children": [6], "extras": {"mass": 3.5}},
            {"name": "Face", "mesh": 0, "skin": 0},
            {"name": "Gruppe ü", "children": [4, 5], "translation": [1, 2, 3], "rotation": TURN},
            {"name": "Hut", "mesh": 1, "translation": [0, 0, 1], "extras": {"felt": True}},
            {"name": "Gruppe ü", "scale": [1, 2, 1], "extras": {"a": {"b": [1, 2]}}},
            {"name": "Head", "translation": [0, 1, 0], "children": [7]},
            {"name": "Anhang", "translation": [0, 0.5, 0], "children": [8]},
            {"name": "Spitze", "rotation": TURN},
        ],
        "skins": [{"joints": [1, 6]}],
        "meshes": [
            {"primitives": [skinned]},
            {"primitives": [{"attributes": {"POSITION": 0}}]},
        ],
    }


def places(path: Path) -> dict[tuple[str, ...], tuple[np.ndarray, Any]]:
    """Where each node stands, and its extras, by the names down to it."""
    document = load_document(path).document
    tree = node_tree(document)
    result = {}
    for index in tree.order:
        names, at = [], index
        while at >= 0:
            names.append(document.nodes[at].name)
            at = tree.parents[at]
        extras = {k: v for k, v in (document.nodes[index].extras or {}).items() if k != "usdface"}
        key = (*reversed(names), *([index] if document.nodes[index].name == "Gruppe ü" else ()))
        result[tuple(map(str, key[: len(names)]))] = tree.worlds[index], extras
    return result


def there_and_back(folder: Path, source: Path) -> tuple[Path, list[Any]]:
    there = import_scene(source, folder / "a.usda", every_frame=True)
    back = export_scene(folder / "a.usda", folder / "b.glb", every_frame=True)
    return folder / "b.glb", [f for f in there.findings + back.findings if f.severity != "info"]


def test_groups_keep_name_place_parent_and_extras(write_glb, tmp_path: Path, validate_gltf) -> None:
    source = write_glb(tmp_path / "a.glb", scene(), [POINTS, JOINTS, WEIGHTS])
    path, found = there_and_back(tmp_path, source)
    assert found == []
    before, after = places(source), places(path)
    kept = [
        ("Gruppe ü",),
        ("Gruppe ü", "Hut"),
        ("Gruppe ü", "Gruppe ü"),
        ("Armature",),
        ("Hips", "Head", "Anhang"),
        ("Hips", "Head", "Anhang", "Spitze"),
    ]
    for names in kept:
        old = before.get(names, before.get(("Armature", *names)))
        assert old is not None and after[names][1] == old[1]
        if names[-1] != "Hut":  # whose points hold its place
            np.testing.assert_allclose(after[names][0], old[0], atol=1e-6)
    assert after["Hips",][1] == {"mass": 3.5}
    assert validate_gltf(path)["issues"]["numErrors"] == 0
    again, found = there_and_back(tmp_path, path)
    assert found == [] and places(again).keys() == after.keys()


def test_groups_are_xforms_that_stand_where_the_nodes_do(write_glb, tmp_path: Path) -> None:
    source = write_glb(tmp_path / "a.glb", scene(), [POINTS, JOINTS, WEIGHTS])
    import_scene(source, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    tip = stage.GetPrimAtPath("/Asset/Groups/Anhang/Spitze")
    world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(tip))
    expected = places(source)["Armature", "Hips", "Head", "Anhang", "Spitze"][0]
    np.testing.assert_allclose(world, expected, atol=1e-6)


def test_a_group_that_was_moved_in_usd_moves_in_the_gltf(write_glb, tmp_path: Path) -> None:
    source = write_glb(tmp_path / "a.glb", scene(), [POINTS, JOINTS, WEIGHTS])
    import_scene(source, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    group = UsdGeom.Xformable(stage.GetPrimAtPath("/Asset/Groups/Gruppe_ü"))
    group.AddTranslateOp(opSuffix="more").Set((0, 0, 5))
    stage.Save()
    done = export_scene(tmp_path / "a.usda", tmp_path / "b.glb", every_frame=True)
    assert done.summary["vertex_error_max_mm"] < 1e-3  # the mesh in it stays
    moved = places(tmp_path / "b.glb")["Gruppe ü",][0] - places(source)["Gruppe ü",][0]
    assert np.linalg.norm(moved[3, :3]) > 4.9


def test_a_mesh_in_a_group_that_shears_it_stays_where_it_is(write_glb, tmp_path: Path) -> None:
    document = scene()
    document["nodes"][3]["scale"] = [1, 3, 1]
    document["nodes"][4]["rotation"] = [0.1, 0.2, 0.3, 0.927]
    source = write_glb(tmp_path / "a.glb", document, [POINTS, JOINTS, WEIGHTS])
    rig, _, _ = read_gltf(source)
    found = write_gltf(rig, tmp_path / "b.glb")
    assert [f.code for f in found if f.severity == "warning"] == []
    back, _, _ = read_gltf(tmp_path / "b.glb")
    for mesh, same in zip(rig.meshes, back.meshes, strict=True):
        np.testing.assert_allclose(same.points, mesh.points, atol=1e-6)


def test_too_many_groups_are_announced(write_glb, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("usdface.io.gltf.groups._MOST", 3)
    source = write_glb(tmp_path / "a.glb", scene(), [POINTS, JOINTS, WEIGHTS])
    rig, _, found = read_gltf(source)
    assert len(rig.groups) == 3
    (dropped,) = (f for f in found if f.code == "NODES_DROPPED")
    assert dropped.message.startswith("2 nodes are left out, their transforms kept: ")


def test_quantised_meshes_stay_in_their_groups(write_glb, tmp_path: Path) -> None:
    source = write_glb(tmp_path / "a.glb", scene(), [POINTS, JOINTS, WEIGHTS])
    rig, _, _ = read_gltf(source)
    write_gltf(rig, tmp_path / "b.glb", options=ExportOptions(quantize=True))
    back, _, _ = read_gltf(tmp_path / "b.glb")
    hat = next(mesh for mesh in rig.meshes if mesh.name == "Hut")
    same = next(mesh for mesh in back.meshes if mesh.name == "Hut")
    assert same.group and same.group == hat.group
    np.testing.assert_allclose(same.points, hat.points, atol=1e-4)
