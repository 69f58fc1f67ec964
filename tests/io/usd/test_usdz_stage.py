from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom
from sheets import codes, sheet

from usdface.io.usd.rig import read_rig
from usdface.io.usd.usdz import write_usdz
from usdface.io.usd.usdz_stage import complete_stage


def test_a_package_has_what_viewers_expect(tmp_path: Path) -> None:
    stage = sheet(up="Z")
    stage.GetRootLayer().pseudoRoot.ClearInfo("metersPerUnit")
    UsdGeom.Xformable(stage.GetPrimAtPath("/R")).AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    stage.DefinePrim("/Aside", "Scope")
    stage.Export(str(tmp_path / "a.usda"))
    found = write_usdz(tmp_path / "a.usda", tmp_path / "a.usdz")
    assert codes(found) == ["DEFAULT_PRIM_CHOSEN", "UNITS_ASSUMED"]
    made = Usd.Stage.Open(str(tmp_path / "a.usdz"))
    assert made.GetDefaultPrim().GetPath() == Sdf.Path("/R")
    assert UsdGeom.GetStageUpAxis(made) == "Y"
    assert made.GetMetadata("metersPerUnit") == 0.01
    shown = [read_rig(tmp_path / name)[0].meshes[0].points for name in ("a.usda", "a.usdz")]
    np.testing.assert_allclose(*shown, atol=1e-7)


def test_what_is_complete_stays() -> None:
    stage = sheet()
    stage.SetDefaultPrim(stage.GetPrimAtPath("/R"))
    layer = stage.Flatten()
    before = layer.ExportToString()
    assert complete_stage(layer) == []
    assert layer.ExportToString() == before


def test_prims_without_a_place_are_laid_down_below() -> None:
    scoped = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(scoped, "Z")
    UsdGeom.SetStageMetersPerUnit(scoped, 1.0)
    scoped.DefinePrim("/World", "Scope")
    UsdGeom.Xform.Define(scoped, "/World/A")
    UsdGeom.Xform.Define(scoped, "/World/A/B")
    flat = scoped.Flatten()
    complete_stage(flat)
    made = Usd.Stage.Open(flat)
    turned = UsdGeom.XformCache().GetLocalToWorldTransform(made.GetPrimAtPath("/World/A/B"))
    assert Gf.IsClose(turned.Transform(Gf.Vec3d(0, 0, 1)), Gf.Vec3d(0, 1, 0), 1e-6)


def test_a_prim_that_does_not_take_the_place_of_others_is_laid_down_itself() -> None:
    placed = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(placed, "Z")
    UsdGeom.SetStageMetersPerUnit(placed, 1.0)
    UsdGeom.Xform.Define(placed, "/World").AddTranslateOp().Set(Gf.Vec3d(5, 0, 0))
    UsdGeom.Xform.Define(placed, "/World/Eye").AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))
    UsdGeom.Xformable(placed.GetPrimAtPath("/World/Eye")).SetResetXformStack(True)
    flat = placed.Flatten()
    complete_stage(flat)
    made = Usd.Stage.Open(flat)
    eye = UsdGeom.XformCache().GetLocalToWorldTransform(made.GetPrimAtPath("/World/Eye"))
    assert Gf.IsClose(eye.Transform(Gf.Vec3d(0, 1, 0)), Gf.Vec3d(0, 1, -1), 1e-6)


def test_markers_of_a_take_are_not_shown() -> None:
    stage = sheet()
    stage.SetDefaultPrim(stage.GetPrimAtPath("/R"))
    stage.DefinePrim("/Take", "UsdFaceMarkerTake")
    layer = stage.Flatten()
    complete_stage(layer)
    made = Usd.Stage.Open(layer)
    assert made.GetPrimAtPath("/Take").GetAttribute("purpose").Get() == "guide"
    assert not made.GetPrimAtPath("/R").GetAttribute("purpose").HasAuthoredValue()
