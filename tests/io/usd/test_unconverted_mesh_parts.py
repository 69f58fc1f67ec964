"""Parts of a mesh that a rig has no place for are announced."""

from pxr import UsdGeom, UsdShade
from sheets import sheet

from usdface.io.usd.rig import rig_of_stage


def test_sets_of_faces_creases_and_velocities_are_announced():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    material = UsdShade.Material.Define(stage, "/R/Skin")
    bound = UsdGeom.Subset.CreateGeomSubset(mesh, "skin", "face", [0], "materialBind")
    UsdShade.MaterialBindingAPI.Apply(bound.GetPrim()).Bind(material)
    UsdGeom.Subset.CreateGeomSubset(mesh, "lips", "face", [0], "faceSet")
    UsdGeom.Subset.CreateGeomSubset(mesh, "rim", "point", [0, 1], "faceSet")
    mesh.CreateCreaseIndicesAttr([0, 1])
    mesh.CreateVelocitiesAttr().Set([(1, 0, 0)] * 3, 2)
    rig, found = rig_of_stage(stage)
    assert [f.values["channels"] for f in found if f.code == "CHANNEL_IGNORED"] == [
        ["creaseIndices", "velocities", "subset lips", "subset rim"]
    ]
    assert [s.material for s in rig.meshes[0].subsets] == ["Skin"]
    mesh.CreateSubdivisionSchemeAttr("none")  # there is no surface to sharpen
    found = rig_of_stage(stage)[1]
    assert [f.values["channels"] for f in found if f.code == "CHANNEL_IGNORED"] == [
        ["velocities", "subset lips", "subset rim"]
    ]


def test_both_sides_without_a_material_are_announced():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    mesh.CreateDoubleSidedAttr(True)

    def lost():
        return [f.values.get("feature") for f in rig_of_stage(stage)[1]]

    assert "double_sided" in lost()
    material = UsdShade.Material.Define(stage, "/R/Skin")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    assert "double_sided" not in lost()
    assert rig_of_stage(stage)[0].materials[0].double_sided


def test_pivots_of_meshes_without_a_skin_are_announced():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    assert [f.code for f in rig_of_stage(stage)[1]] == []
    UsdGeom.Xformable(mesh).AddTranslateOp().Set((0, 1, 0))
    (found,) = rig_of_stage(stage)[1]
    assert (found.code, found.values["meshes"]) == ("PIVOTS_DROPPED", ["/R/M"])
