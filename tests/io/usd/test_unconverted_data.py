"""Custom attributes, metadata and variants arrive or are announced."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel
from sheets import sheet

from usdface.clips import Clip
from usdface.findings import Finding
from usdface.io.usd import unconverted_data
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.unconverted_data import report_lost_groups, report_unconverted_variants
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import Rig
from usdface.scene import Group
from usdface.takes import WeightsTake


def ignored(found: list[Finding]) -> list[str]:
    (one,) = [f for f in found if f.code == "CHANNEL_IGNORED"]
    return list(one.values["channels"])


def give(prim: Usd.Prim, name: str, value: float | str) -> Usd.Attribute:
    kinds = Sdf.ValueTypeNames
    kind = kinds.String if isinstance(value, str) else kinds.Double
    attribute = prim.CreateAttribute(name, kind, custom=True)
    attribute.Set(value)
    return attribute


def test_custom_properties_of_other_programs_are_extras(tmp_path: Path) -> None:
    stage = sheet()
    mesh, root = stage.GetPrimAtPath("/R/M"), stage.GetPrimAtPath("/R")
    give(mesh, "userProperties:age", 3.0)
    give(mesh, "userProperties:blender:object_name", "Head")
    mesh.SetCustomDataByKey("note", "by hand")
    give(root, "userProperties:show", "X")
    rig, found = rig_of_stage(stage)
    expected = {"age": 3.0, "blender": {"object_name": "Head"}, "note": "by hand"}
    assert rig.meshes[0].extras == expected
    assert rig.extras == {"show": "X"}
    assert "CHANNEL_IGNORED" not in [f.code for f in found]
    stage.Export(str(tmp_path / "a.usda"))
    export_scene(tmp_path / "a.usda", tmp_path / "a.glb")
    import_scene(tmp_path / "a.glb", tmp_path / "b.usda")
    back = Usd.Stage.Open(str(tmp_path / "b.usda"))
    (head,) = [prim for prim in back.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert head.GetCustomDataByKey("age") == 3.0
    assert head.GetCustomDataByKey("blender:object_name") == "Head"


def test_custom_data_that_nothing_keeps_is_announced() -> None:
    stage = sheet()
    mesh = stage.GetPrimAtPath("/R/M")
    give(mesh, "studio:id", 7.0)
    for code in (0.0, 1.0):
        give(mesh, "userProperties:heat", 1.0).Set(code, code)
    group = UsdGeom.Xform.Define(stage, "/R/Group").GetPrim()
    give(group, "userProperties:lod", 1.0)
    group.SetCustomDataByKey("step", 2)
    group.SetCustomDataByKey("usdface", {"ours": True})
    group.SetAssetInfoByKey("version", "12")
    mesh.SetDocumentation("of the second sitting")
    stage.GetPrimAtPath("/R").SetAssetInfoByKey("copyright", "kept")
    take = stage.DefinePrim("/Take", "UsdFaceMarkerTake")
    mesh.CreateAttribute("studio:rig", Sdf.ValueTypeNames.Int, custom=False).Set(3)
    give(take, "userProperties:scene", 4.0)
    give(mesh, "usdface:residual", 0.5)
    group.CreateRelationship("material:binding")  # without its schema
    assert ignored(rig_of_stage(stage)[1]) == [
        "/R/M.studio:id",
        "/R/M.studio:rig",
        "/R/M.userProperties:heat",
        "/R/Group step",
        "/R/Group.userProperties:lod",
        "/R/M documentation",
        "/R/Group assetInfo",
    ]


def test_a_property_below_another_has_a_name_of_its_own() -> None:
    """As Blender 2.8 wrote names of data, and below them those of texture coordinates."""
    stage = sheet()
    mesh = stage.GetPrimAtPath("/R/M")
    give(mesh, "userProperties:names:data", "Cube")
    give(mesh, "userProperties:names:data:st", "UVMap")
    give(mesh, "userProperties:names:st", "plain")
    rig, _ = rig_of_stage(stage)
    assert rig.meshes[0].extras == {"names": {"data": "Cube", "data_st": "UVMap", "st": "plain"}}


def test_a_property_with_samples_that_do_not_differ_is_kept() -> None:
    """As of exports of an animation, which sample each property at one frame, or at all."""
    stage = sheet()
    mesh = stage.GetPrimAtPath("/R/M")
    for name, codes in (("once", (1.0,)), ("each", (1.0, 2.0, 3.0))):
        attribute = mesh.CreateAttribute(f"userProperties:{name}", Sdf.ValueTypeNames.Int)
        for code in codes:
            attribute.Set(5, code)
    rig, found = rig_of_stage(stage)
    assert rig.meshes[0].extras == {"once": 5, "each": 5}
    assert "CHANNEL_IGNORED" not in [f.code for f in found]


def test_what_exporters_note_on_each_prim_is_not_announced() -> None:
    stage = sheet()
    group = UsdGeom.Xform.Define(stage, "/R/Group").GetPrim()
    give(group, "userProperties:blender:object_name", "Group")
    give(group, "userProperties:blenderName:object", "Group")
    group.SetCustomDataByKey("Blender", {"generated": True})
    group.SetCustomDataByKey("HoudiniPrimEditorNodeId", 7)
    assert "CHANNEL_IGNORED" not in [f.code for f in rig_of_stage(stage)[1]]
    group.SetCustomDataByKey("Studio", {"generated": False})
    assert ignored(rig_of_stage(stage)[1]) == ["/R/Group Studio"]


def test_prims_of_other_types_are_announced() -> None:
    stage = sheet()
    stage.DefinePrim("/Render/Settings", "RenderSettings")
    stage.DefinePrim("/R/Control", "StudioControl")
    stage.DefinePrim("/Take", "UsdFaceMarkerTake")
    for name in ("Xform", "Scope", "Camera", "DomeLight", "Skeleton", "Material", "Points"):
        stage.DefinePrim(f"/R/{name}", name)
    stage.DefinePrim("/R/M/lips", "GeomSubset")
    (lost,) = [f for f in rig_of_stage(stage)[1] if "types" in f.message]
    assert lost.code == "CHANNEL_IGNORED"
    assert lost.values["channels"] == [
        "StudioControl /R/Control",
        "RenderSettings /Render/Settings",
    ]


def with_variants(prim: Usd.Prim, name: str, *variants: str) -> Usd.VariantSet:
    chosen = prim.GetVariantSets().AddVariantSet(name)
    for variant in variants:
        chosen.AddVariant(variant)
    chosen.SetVariantSelection(variants[0])
    return chosen


def test_variants_that_are_not_selected_are_announced() -> None:
    stage = sheet()
    root = stage.GetPrimAtPath("/R")
    with_variants(root, "only", "one")
    assert report_unconverted_variants(stage) == []
    lods = with_variants(root, "lod", "high", "low")
    lods.SetVariantSelection("low")
    with lods.GetVariantEditContext():
        UsdGeom.Mesh.Define(stage, "/R/Coarse").CreatePointsAttr([(0, 0, 0)])
    lods.SetVariantSelection("high")
    with_variants(stage.GetPrimAtPath("/R/M"), "hair", "short", "long").ClearVariantSelection()
    (lost,) = [f for f in rig_of_stage(stage)[1] if "variants" in f.values]
    assert lost.code == "FEATURE_DROPPED"
    assert lost.values["variants"] == ["/R lod=high", "/R/M hair=none"]
    assert lods.GetVariantSelection() == "high"


def test_variants_of_a_set_do_not_open_the_stage_again(monkeypatch) -> None:
    """A set has hundreds of props with variants; clips are only those of characters."""
    stage = sheet()
    prop = UsdGeom.Xform.Define(stage, "/Set/Prop").GetPrim()
    with_variants(prop, "lod", "high", "low")
    opened: list[object] = []
    monkeypatch.setattr(unconverted_data, "stage_with_variant", opened.append)
    (lost,) = report_unconverted_variants(stage)
    assert lost.values["variants"] == ["/Set/Prop lod=high"]
    assert opened == []


def test_variants_that_are_clips_or_materials_arrive(face_rig: Rig, tmp_path: Path) -> None:
    times, count = [0.0, 0.1], len(face_rig.shape_names)
    takes = [WeightsTake(face_rig.shape_names, times, np.full((2, count), w), 10.0) for w in (0, 1)]
    clips = tuple(Clip(n, take) for n, take in zip(("calm", "wild"), takes, strict=True))
    write_rig(face_rig, tmp_path / "a.usda", clips)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    (root,) = [prim for prim in stage.Traverse() if prim.GetTypeName() == "SkelRoot"]
    assert root.GetVariantSet("animation").GetVariantNames() == ["calm", "wild"]
    looks = with_variants(stage.GetDefaultPrim(), "material", "default", "red")
    looks.SetVariantSelection("red")
    with looks.GetVariantEditContext():
        UsdShade.Material.Define(stage, "/Asset/Red")
    looks.SetVariantSelection("default")
    assert report_unconverted_variants(stage) == []
    _, moving, found = animated_rig(stage)
    assert [clip.name for clip in moving] == ["calm", "wild"]
    assert [f for f in found if "variants" in f.values] == []


def test_a_skeleton_without_a_mesh_is_announced(skinned_rig: Rig, tmp_path: Path) -> None:
    write_rig(skinned_rig, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert [f for f in rig_of_stage(stage)[1] if f.values.get("feature") == "skeleton"] == []
    UsdSkel.Skeleton.Define(stage, "/Asset/Empty")
    prop = UsdSkel.Skeleton.Define(stage, "/Asset/Prop")
    prop.CreateJointsAttr(["grip", "grip/tip"])
    (lost,) = [f for f in rig_of_stage(stage)[1] if f.values.get("feature") == "skeleton"]
    assert (lost.code, lost.where) == ("FEATURE_DROPPED", "/Asset/Prop")
    assert lost.values["names"] == ["grip", "grip/tip"]


def test_groups_that_carry_nothing_are_announced(tmp_path: Path) -> None:
    stage = sheet()
    UsdGeom.Xform.Define(stage, "/World/Sockets/Hat").AddTranslateOp().Set((0, 1, 0))
    stage.DefinePrim("/World", "Xform")
    stage.DefinePrim("/World/Sockets", "Scope")
    UsdGeom.Camera.Define(stage, "/World/Rig/Cam")
    stage.DefinePrim("/World/Rig", "Xform")
    (lost,) = [f for f in rig_of_stage(stage)[1] if f.code == "NODES_DROPPED"]
    assert dict(lost.values) == {"node_count": 1, "nodes": ["/World/Sockets/Hat"]}


def test_groups_above_meshes_of_other_names_are_announced() -> None:
    """As Blender writes an object above its data; above a SkelRoot stands the asset."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    Sdf.CreatePrimInLayer(layer, "/World").specifier = Sdf.SpecifierDef
    source = sheet()
    Sdf.CopySpec(source.GetRootLayer(), "/R", layer, "/World/R")
    stage = Usd.Stage.Open(layer)
    UsdGeom.Xform.Define(stage, "/World")
    for path in ("/World/R/Eyes/eye_l", "/World/R/Teeth/Teeth", "/World/R/Hair/Strands/hair"):
        mesh = UsdGeom.Mesh.Define(stage, path)
        mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
        mesh.CreateFaceVertexCountsAttr([3])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
        UsdGeom.Xform.Define(stage, mesh.GetPath().GetParentPath())
    UsdGeom.Xform.Define(stage, "/World/R/Hair")
    (lost,) = [f for f in rig_of_stage(stage)[1] if f.code == "NODES_DROPPED"]
    nodes = ["/World/R/Eyes", "/World/R/Hair", "/World/R/Hair/Strands"]
    assert dict(lost.values) == {"node_count": 3, "nodes": nodes}


def test_groups_in_groups_are_announced_at_any_depth() -> None:
    stage = Usd.Stage.CreateInMemory()
    deep = "".join(f"/g{n}" for n in range(40))
    UsdGeom.Mesh.Define(stage, f"{deep}/hair")
    UsdGeom.Xform.Define(stage, "/g0/socket/tip")
    UsdGeom.Mesh.Define(stage, "/set/many/prototypes/leaf")
    UsdGeom.PointInstancer.Define(stage, "/set/many")
    UsdGeom.Xform.Define(stage, "/set")
    groups = Sdf.Path(deep).GetPrefixes()
    for path in [*groups, Sdf.Path("/g0/socket")]:
        UsdGeom.Xform.Define(stage, path)
    empty, others = report_lost_groups(stage, ())
    assert empty.values["nodes"] == ["/g0/socket", "/g0/socket/tip"]
    assert others.values["nodes"] == [*map(str, groups), "/set"]


def test_groups_of_a_gltf_are_kept(face_rig: Rig, tmp_path: Path) -> None:
    group = Group("Socket", "Socket", np.eye(4))
    write_rig(replace(face_rig, groups=(group,)), tmp_path / "a.usda")
    rig, found = rig_of_stage(Usd.Stage.Open(str(tmp_path / "a.usda")))
    assert [one.path for one in rig.groups] == ["Socket"]
    assert "NODES_DROPPED" not in [f.code for f in found]
