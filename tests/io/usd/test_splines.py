import pytest
from pxr import Sdf, Ts, Usd, UsdGeom
from sheets import sheet

from usdface.io.usd import splines
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.splines import report_splines


def with_spline() -> tuple[Usd.Stage, Usd.Attribute]:
    stage = sheet()
    move = UsdGeom.Xformable(stage.GetPrimAtPath("/R")).AddTranslateXOp()
    move.GetAttr().SetSpline(curve())
    return stage, move.GetAttr()


def curve() -> Ts.Spline:
    made = Ts.Spline("double")
    for code in (0.0, 10.0):
        made.SetKnot(Ts.Knot("double", time=code, value=code))
    return made


def test_splines_are_announced_where_usd_does_not_evaluate_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stage, moved = with_spline()
    silent = moved.Get(5.0) is None
    assert [f.code for f in report_splines(stage)] == ["SPLINES_UNREAD"] * silent
    monkeypatch.setattr(splines, "_EVALUATED", False)
    (found,) = [f for f in rig_of_stage(stage)[1] if f.code == "SPLINES_UNREAD"]
    assert found.values["attributes"] == ["/R.xformOp:translateX"]


def test_samples_count_before_a_spline_and_ours_take_none(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, moved = with_spline()
    moved.Set(1.0, 0.0)
    setup = stage.DefinePrim("/S", "UsdFaceRetarget")
    pin = setup.CreateAttribute("usdface:pin:jawOpen", Sdf.ValueTypeNames.Double)
    pin.SetSpline(curve())
    monkeypatch.setattr(splines, "_EVALUATED", False)
    assert report_splines(stage) == []
