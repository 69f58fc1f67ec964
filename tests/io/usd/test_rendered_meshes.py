"""What a stage shows is converted; what else is there is announced."""

from pathlib import Path

import pytest
from pxr import Usd, UsdGeom, UsdSkel, Vt
from sheets import codes, sheet

from usdface.cli import main
from usdface.errors import InputError
from usdface.io.usd.rig import rig_of_stage
from usdface.options import ExportOptions
from usdface.pipeline import export_scene, make_rig


def another(stage: Usd.Stage, path: str) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 2, 3)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    return mesh


def names(stage: Usd.Stage) -> list[str]:
    return [mesh.name for mesh in rig_of_stage(stage)[0].meshes]


@pytest.mark.parametrize("purpose", ["guide", "proxy"])
def test_guides_and_proxies_are_left_out(tmp_path: Path, purpose: str) -> None:
    stage = sheet()
    another(stage, "/R/Cage").CreatePurposeAttr(purpose)
    another(stage, "/R/Fine").CreatePurposeAttr("render")
    rig, found = rig_of_stage(stage)
    assert [m.name for m in rig.meshes] == ["M", "Fine"]
    assert [(f.code, f.where) for f in found] == [("FEATURE_DROPPED", "/R/Cage")]
    stage.Export(str(tmp_path / "a.usda"))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True)
    assert done.value is not None and done.value.missing == ()


def test_a_proxy_alone_is_kept(tmp_path: Path) -> None:
    stage = sheet()
    UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).CreatePurposeAttr("proxy")
    assert names(stage) == ["M"]


def test_invisible_meshes_are_left_out_unless_all_are() -> None:
    stage = sheet()
    another(stage, "/R/Hidden").CreateVisibilityAttr("invisible")
    rig, found = rig_of_stage(stage)
    assert [m.name for m in rig.meshes] == ["M"] and codes(found) == ["FEATURE_DROPPED"]
    UsdGeom.Imageable(stage.GetPrimAtPath("/R")).CreateVisibilityAttr("invisible")
    rig, found = rig_of_stage(stage)
    assert len(rig.meshes) == 2 and codes(found) == ["FEATURE_APPROXIMATED"] * 2
    assert [m.name for m in rig_of_stage(stage, "/R")[0].meshes] == ["M", "Hidden"]


def test_visibility_that_changes_is_announced() -> None:
    stage = sheet()
    seen = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).CreateVisibilityAttr()
    seen.Set("inherited", 0)
    seen.Set("inherited", 5)
    assert codes(rig_of_stage(stage)[1]) == []
    seen.Set("invisible", 9)
    assert codes(rig_of_stage(stage)[1]) == ["ANIMATION_DROPPED"]


def test_points_that_change_are_announced() -> None:
    stage = sheet()
    points = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).GetPointsAttr()
    for code in (0, 9):
        points.Set(Vt.Vec3fArray([(0, 0, code), (1, 0, 0), (0, 2, 3)]), code)
    assert codes(rig_of_stage(stage)[1]) == ["ANIMATION_DROPPED"]


@pytest.mark.parametrize(
    "kind", ["Sphere", "Cube", "Capsule", "BasisCurves", "NurbsPatch", "Points", "PointInstancer"]
)
def test_shapes_that_are_no_meshes_are_announced(kind: str) -> None:
    stage = sheet()
    stage.DefinePrim("/R/Thing", kind)
    if kind == "PointInstancer":
        UsdGeom.PointInstancer(stage.GetPrimAtPath("/R/Thing")).CreateProtoIndicesAttr([0, 0, 0])
    (found,) = rig_of_stage(stage)[1]
    assert (found.code, found.where) == ("FEATURE_DROPPED", "/R/Thing")
    assert kind in found.message and ("3 inst" in found.message) == (kind == "PointInstancer")


@pytest.mark.parametrize("place", ["/R/Crowd", "/A_Crowd"])
def test_prototypes_of_instancers_are_not_where_they_stand(tmp_path: Path, place: str) -> None:
    stage = sheet()
    UsdGeom.PointInstancer.Define(stage, place).CreateProtoIndicesAttr([0, 0])
    UsdSkel.Root.Define(stage, f"{place}/Double")
    another(stage, f"{place}/Double/D")
    rig, found = rig_of_stage(stage)
    assert [mesh.path for mesh in rig.meshes] == ["/R/M"]
    assert [(f.code, f.where) for f in found] == [("FEATURE_DROPPED", place)]
    stage.Export(str(tmp_path / "a.usda"))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True)
    assert done.value is not None and done.value.missing == ()
    stage.RemovePrim("/R/M")
    if place == "/A_Crowd":  # a character that is nowhere else
        stage.RemovePrim("/R")
        assert names(stage) == ["D"]


def test_a_mesh_outside_of_the_skelroot_is_kept_without_its_blend_shapes() -> None:
    stage = sheet()
    another(stage, "/Eyes")
    rig, found = rig_of_stage(stage)
    assert [mesh.path for mesh in rig.meshes] == ["/R/M", "/Eyes"] and not found
    eyes = stage.GetPrimAtPath("/Eyes")
    UsdSkel.BindingAPI.Apply(eyes).CreateBlendShapesAttr(["look"])
    shape = UsdSkel.BlendShape.Define(stage, "/Eyes/look")
    shape.CreateOffsetsAttr([(0, 0, 1)])
    shape.CreatePointIndicesAttr([0])
    UsdSkel.BindingAPI(eyes).CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
    rig, (announced,) = rig_of_stage(stage)
    assert (announced.code, announced.where) == ("MESH_OUTSIDE", "/Eyes")
    assert rig.meshes[1].shapes == ()


def test_what_moves_outside_of_the_skelroot_moves_in_gltf(tmp_path: Path) -> None:
    stage = sheet()
    another(stage, "/Eyes")
    move = UsdGeom.Xformable(stage.GetPrimAtPath("/Eyes")).AddTranslateOp()
    for code in (0, 10):
        move.Set((0, 0.1 * code, 0), code)
    stage.GetRootLayer().Export(str(tmp_path / "a.usda"))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True)
    assert done.summary["meshes"] == 2 and done.summary["clips"] == 1
    assert done.value is not None and done.value.missing == ()
    assert done.summary["vertex_error_max_mm"] < 1e-2
    made = make_rig(tmp_path / "a.glb", tmp_path / "rig.usda")
    assert made.summary["meshes"] == 2


@pytest.mark.parametrize("purpose", ["guide", "proxy"])
def test_a_purpose_is_kept_if_it_is_asked_for(tmp_path: Path, purpose: str) -> None:
    stage = sheet()
    another(stage, "/R/Cage").CreatePurposeAttr(purpose)
    stage.Export(str(tmp_path / "a.usda"))
    options = ExportOptions(purpose=(purpose,))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True, options=options)
    assert done.summary["meshes"] == 2
    assert done.value is not None and done.value.missing == ()
    assert (
        main(["export", f"{tmp_path}/a.usda", "-o", f"{tmp_path}/b.glb", "--purpose", purpose]) == 0
    )
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    with pytest.raises(InputError, match="expected guide, proxy"):
        ExportOptions(purpose=("rendr",))
