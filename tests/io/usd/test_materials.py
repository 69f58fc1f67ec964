from dataclasses import replace
from pathlib import Path

import pytest
from pxr import Sdf, UsdGeom, UsdShade, UsdUtils
from sheets import codes, sheet

from usdface.io.usd.rig import read_rig, rig_of_stage
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import Material, Rig, Texture


def test_materials_and_textures_come_back(face_rig, tmp_path):
    (tmp_path / "near").mkdir()
    (tmp_path / "near" / "skin.png").write_bytes(b"near")
    material = Material(
        "Skin",
        (0.5, 0.25, 0.75),
        0.5,
        0.25,
        0.75,
        (0.125, 0.5, 1.0),
        True,
        base_color_texture=Texture(str(tmp_path / "near" / "skin.png"), None, ".png"),
        normal_texture=Texture("", b"bumps", ".png"),
        metallic_texture=Texture("", b"orm", ".jpg", "b"),
        roughness_texture=Texture("", b"orm", ".jpg", "g"),
        occlusion_texture=Texture("", b"orm", ".jpg"),
        emissive_texture=Texture("", b"glow", ".png"),
    )
    mesh = replace(face_rig.meshes[0], material="Skin", subsets=())
    path = tmp_path / "rig.usda"
    write_rig(Rig("r", (mesh,), None, (material,)), path)
    (back,) = read_rig(path)[0].materials
    plain = {k: getattr(back, k) for k in ("name", "base_color", "opacity", "metallic")}
    assert plain == {k: getattr(material, k) for k in plain}
    assert (back.roughness, back.emissive, back.double_sided) == (0.75, (0.125, 0.5, 1.0), True)
    read = {
        role: Path(getattr(back, f"{role}_texture").path).read_bytes()
        for role in ("base_color", "normal", "metallic", "roughness", "occlusion", "emissive")
    }
    assert read == {
        "base_color": b"near",
        "normal": b"bumps",
        "metallic": b"orm",
        "roughness": b"orm",
        "occlusion": b"orm",
        "emissive": b"glow",
    }


def test_a_texture_outside_the_folder_of_its_file_is_left_out(face_rig, tmp_path):
    (tmp_path / "secret.png").write_bytes(b"x")
    mesh = replace(face_rig.meshes[0], material="Skin", subsets=())
    inside = tmp_path / "asset" / "rig.usda"
    material = Material("Skin", base_color_texture=Texture("", b"x", ".png"))
    write_rig(Rig("r", (mesh,), None, (material,)), inside)
    text = inside.read_text().replace("./rig_textures/Skin_baseColor.png", "../secret.png")
    inside.write_text(text)
    rig, findings = read_rig(inside)
    assert rig.materials[0].base_color_texture is None
    assert codes(findings) == ["ASSET_OUTSIDE"] and "outside the folder" in findings[0].message
    inside.write_text(text.replace("../secret.png", "./none.png"))
    assert "does not exist" in read_rig(inside)[1][0].message


def test_textures_inside_a_package_come_as_bytes(face_rig, tmp_path):
    mesh = replace(face_rig.meshes[0], material="Skin", subsets=())
    material = Material("Skin", base_color_texture=Texture("", b"pixels", ".png"))
    write_rig(Rig("r", (mesh,), None, (material,)), tmp_path / "rig.usdc")
    package = tmp_path / "rig.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "rig.usdc"), str(package))
    texture = read_rig(package)[0].materials[0].base_color_texture
    assert (texture.data, texture.suffix) == (b"pixels", ".png")


def test_materials_of_one_name_stay_apart():
    stage = sheet()
    for scope, value in (("A", 0.25), ("B", 0.75)):
        material = UsdShade.Material.Define(stage, f"/{scope}/Skin")
        surface = UsdShade.Shader.Define(stage, f"/{scope}/Skin/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(value)
        output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(output)
    binding = UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath("/R/M"))
    binding.Bind(UsdShade.Material(stage.GetPrimAtPath("/A/Skin")))
    subset = binding.CreateMaterialBindSubset("part", [0])
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(
        UsdShade.Material(stage.GetPrimAtPath("/B/Skin"))
    )
    rig, findings = rig_of_stage(stage)
    assert [(m.name, m.roughness) for m in rig.materials] == [("Skin", 0.25), ("Skin_1", 0.75)]
    assert rig.meshes[0].subsets[0].material == "Skin_1" and codes(findings) == ["NAME_CHANGED"]


def surface_of(stage):
    """Bind a UsdPreviewSurface without inputs to the sheet; return its shader."""
    material = UsdShade.Material.Define(stage, "/R/Skin")
    shader = UsdShade.Shader.Define(stage, "/R/Skin/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    prim = stage.GetPrimAtPath("/R/M")
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
    return shader


def test_inputs_that_are_not_authored_are_those_of_the_schema():
    stage = sheet()
    surface_of(stage)
    rig, findings = rig_of_stage(stage)
    assert rig.materials[0].base_color == (0.18, 0.18, 0.18)
    assert rig.materials[0].emissive == (0.0, 0.0, 0.0)
    assert codes(findings) == []


def test_inputs_that_change_over_time_stay_at_the_first():
    stage = sheet()
    shader = surface_of(stage)
    colour = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    rough = shader.CreateInput("roughness", Sdf.ValueTypeNames.Float)
    for code, value in ((3, 0.25), (9, 1.0)):
        colour.Set((value, 0.5, 0.5), code)
        rough.Set(value, code)
    rig, findings = rig_of_stage(stage)
    assert rig.materials[0].base_color == (0.25, 0.5, 0.5)
    assert rig.materials[0].roughness == 0.25
    assert codes(findings) == ["ANIMATION_DROPPED"] * 2


def test_occlusion_without_a_texture_is_announced():
    stage = sheet()
    occlusion = surface_of(stage).CreateInput("occlusion", Sdf.ValueTypeNames.Float)
    occlusion.Set(0.5)
    (lost,) = rig_of_stage(stage)[1]
    assert (lost.code, lost.values["feature"]) == ("FEATURE_DROPPED", "occlusion")
    occlusion.Set(1.0)
    assert rig_of_stage(stage)[1] == []


@pytest.mark.parametrize(
    ("scale", "bias", "kept"),
    [
        ((2, 2, 2, 1), (-1, -1, -1, 0), True),
        ((1, 1, 2, 1), (-0.5, -0.5, -1, 0), True),  # half as strong
        ((2, -2, 2, 1), (-1, 1, -1, 0), False),  # as DirectX has them
        ((1, 1, 1, 1), (0, 0, 0, 0), False),
    ],
)
def test_normal_maps_that_gltf_reads_otherwise_are_announced(scale, bias, kept):
    stage = sheet()
    surface = surface_of(stage)
    image = UsdShade.Shader.Define(stage, "/R/Skin/Bumps")
    image.CreateIdAttr("UsdUVTexture")
    for name, value in (("scale", scale), ("bias", bias)):
        image.CreateInput(name, Sdf.ValueTypeNames.Float4).Set(value)
    output = image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(output)
    found = [f.values.get("feature") for f in rig_of_stage(stage)[1]]
    assert ("normal_map" in found) != kept


def test_faces_of_a_material_that_change_over_time_are_announced():
    stage = sheet()
    surface_of(stage)
    mesh = UsdGeom.Mesh.Get(stage, "/R/M")
    subset = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).CreateMaterialBindSubset("s", [0])
    skin = UsdShade.Material.Define(stage, "/R/Other")
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(skin)
    for code, faces in ((1, [0]), (2, [])):
        subset.GetIndicesAttr().Set(faces, code)
    found = rig_of_stage(stage)[1]
    assert [f.where for f in found if f.code == "ANIMATION_DROPPED"] == ["/R/M/s"]


def test_materials_that_no_mesh_shows_are_announced():
    stage = sheet()
    surface_of(stage)
    UsdShade.Material.Define(stage, "/Library/Gold")
    _, findings = rig_of_stage(stage)
    assert [(f.code, f.values["channels"]) for f in findings] == [
        ("CHANNEL_IGNORED", ["/Library/Gold"])
    ]


def test_networks_of_other_renderers_are_announced():
    stage = sheet()
    shader = surface_of(stage)
    material = UsdShade.Material.Get(stage, "/R/Skin")
    material.CreateDisplacementOutput().ConnectToSource(shader.ConnectableAPI(), "displacement")
    material.CreateSurfaceOutput("ri")  # connected to nothing
    other = UsdShade.Shader.Define(stage, "/R/Skin/Standard")
    other.CreateIdAttr("ND_standard_surface_surfaceshader")
    material.CreateSurfaceOutput("mtlx").ConnectToSource(other.ConnectableAPI(), "out")
    _, findings = rig_of_stage(stage)
    assert [(f.code, f.values["channels"]) for f in findings] == [
        ("CHANNEL_IGNORED", ["outputs:mtlx:surface"])
    ]


def test_sides_that_differ_within_a_mesh_are_announced_and_come_back(face_rig, tmp_path):
    """The lips show both sides, the skin does not; USD knows it of meshes alone."""
    found = write_rig(face_rig, tmp_path / "a.usda")
    (result,) = (f for f in found if f.code == "FEATURE_APPROXIMATED")
    assert "also of skin" in result.message
    back = read_rig(tmp_path / "a.usda")[0]
    assert {m.name: m.double_sided for m in back.materials} == {"skin": False, "lips": True}
    one = replace(face_rig.meshes[0], subsets=(), material="lips")
    found = write_rig(replace(face_rig, meshes=(one,)), tmp_path / "b.usda")
    assert "FEATURE_APPROXIMATED" not in codes(found)
