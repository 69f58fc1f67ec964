"""Transforms of prims to the world."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom
from sheets import sheet

from usdface.io.usd.clips import animated_rig
from usdface.io.usd.world_transforms import moves_in_world, transform_codes, world_transform


def test_what_moves_above_a_prim_moves_it() -> None:
    stage = Usd.Stage.CreateInMemory()
    above = UsdGeom.Xform.Define(stage, "/above")
    UsdGeom.Scope.Define(stage, "/above/scope")  # has no transform of its own
    below = UsdGeom.Xform.Define(stage, "/above/scope/below")
    below.AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    assert not moves_in_world(below.GetPrim())
    move = above.AddTranslateOp()
    for code in (0.0, 2.0):
        move.Set(Gf.Vec3d(0, code, 0), code)
    assert moves_in_world(below.GetPrim())
    np.testing.assert_allclose(world_transform(below.GetPrim(), 1.0)[3, :3], [1, 1, 0])
    assert not moves_in_world(stage.GetPseudoRoot())


@pytest.mark.skipif(Usd.GetVersion() < (0, 25, 5), reason="this USD does not evaluate splines")
def test_a_transform_that_a_spline_moves_is_a_clip() -> None:
    from pxr import Ts

    stage = sheet()
    move = UsdGeom.Xformable(stage.GetPrimAtPath("/R/M")).AddTranslateXOp()
    spline = Ts.Spline("double")
    for code, value in ((0.0, 0.0), (12.0, 5.0)):
        knot = Ts.Knot("double")
        knot.SetTime(code)
        knot.SetValue(value)
        knot.SetNextInterpolation(Ts.InterpCurve)
        knot.SetPreTanWidth(4.0)
        knot.SetPostTanWidth(4.0)
        spline.SetKnot(knot)
    move.GetAttr().SetSpline(spline)
    assert transform_codes(UsdGeom.Xformable(stage.GetPrimAtPath("/R/M"))) == [0.0, 12.0]
    _, (clip,), _ = animated_rig(stage)
    assert clip.joints is not None
    times, moved = clip.joints.times, clip.joints.translations[:, 0, 0]
    assert len(times) > 5  # it eases in and out
    codes = np.linspace(0, 12, 25)
    exact = [move.GetAttr().Get(code) for code in codes]
    seconds = codes / stage.GetTimeCodesPerSecond()
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    np.testing.assert_allclose(np.interp(seconds, times, moved), np.array(exact) * unit, atol=1e-4)
