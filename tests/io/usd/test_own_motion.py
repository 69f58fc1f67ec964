"""A character's own motion of its head and eyes, which the take replaces, is reported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from eye_rig import with_eyes
from processed import shoot
from pxr import Gf, Usd, UsdSkel
from worlds import make_world

from usdface.findings import Finding
from usdface.io.usd.take_write import write_take
from usdface.pipeline import apply, process
from usdface.takes import WeightsTake

JOINTS = ("neck", "neck/head", "neck/head/eyeL")


def turning(path: Path, *joints: str, start: int = 0) -> None:
    """Give a rig's joints an animation in which `joints` turn by 20 degrees from a frame on."""
    stage = Usd.Stage.Open(str(path))
    animation = UsdSkel.Animation(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation)))
    animation.CreateJointsAttr(JOINTS)
    animation.CreateTranslationsAttr([(0, 0, 0)] * len(JOINTS))
    animation.CreateScalesAttr([(1, 1, 1)] * len(JOINTS))
    for code, angle in ((0, 0.0), (20, np.radians(20)), (39, 0.0)):
        turn = Gf.Quatf(float(np.cos(angle / 2)), 0, float(np.sin(angle / 2)), 0)
        turns = [turn if joint in joints else Gf.Quatf(1) for joint in JOINTS]
        animation.CreateRotationsAttr().Set(turns, start + code)
    stage.Save()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    world = make_world()
    return replace(world, rig=with_eyes(world.rig)).write(tmp_path, mesh="/Asset/Face/head")


def dropped(findings: tuple[Finding, ...]) -> list[object]:
    return [each.values["joint"] for each in findings if each.code == "ANIMATION_DROPPED"]


@pytest.mark.parametrize("joints", [(), ("neck",), ("neck", "neck/head", "neck/head/eyeL")])
def test_motion_of_the_head_is_reported_where_it_is_replaced(
    folder: Path, joints: tuple[str, ...]
) -> None:
    turning(folder / "rig.usda", *joints)
    found = process(shoot(folder)).findings
    assert dropped(found) == [joint for joint in joints if joint == "neck/head"]


def test_motion_of_the_head_beyond_the_take_is_reported(folder: Path) -> None:
    turning(folder / "rig.usda", "neck", "neck/head", start=60)
    assert dropped(process(shoot(folder)).findings) == ["neck/head"]


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_weights_that_change_beyond_the_take_are_reported(folder: Path, weight: float) -> None:
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    stage.SetTimeCodesPerSecond(30)  # the take's
    prim = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    count = len(UsdSkel.Animation(prim).GetBlendShapesAttr().Get())
    weights = UsdSkel.Animation(prim).CreateBlendShapeWeightsAttr()
    for code, value in ((-9, 0.2), (0, 0.2), (39, 0.2), (60, 0.2 + weight), (90, 0.2)):
        weights.Set([value] * count, code)
    stage.Save()
    lost = [each for each in process(shoot(folder)).findings if each.code == "ANIMATION_DROPPED"]
    assert [dict(each.values) for each in lost] == (
        [{"first_code": 60, "last_code": 60}] if weight else []
    )


def test_it_is_not_where_the_head_stays_still(folder: Path) -> None:
    turning(folder / "rig.usda", "neck/head")
    shot = shoot(folder)
    layer = Usd.Stage.Open(str(shot))
    layer.GetPrimAtPath("/Shot/Retarget").GetAttribute("usdface:head:apply").Set(False)
    layer.Save()
    assert dropped(process(shot).findings) == []


def test_motion_of_an_eye_is_reported_where_that_of_the_take_replaces_it(folder: Path) -> None:
    turning(folder / "rig.usda", *JOINTS)
    world = make_world()
    names = (*world.rig.shape_names, "eyeLookInLeft", "eyeLookOutLeft")
    weights = np.zeros((12, len(names)))
    weights[:, -1] = np.linspace(0, 1, 12)
    write_take(WeightsTake(names, np.arange(12) / 30, weights, 30.0), folder / "take.usda")
    (folder / "bind.json").unlink()
    assert dropped(process(shoot(folder)).findings) == ["neck/head/eyeL"]


def test_a_result_of_an_earlier_run_is_no_own_motion(folder: Path) -> None:
    stage = Usd.Stage.Open(str(shoot(folder)))
    stage.SetEditTarget(stage.GetSessionLayer())
    assert dropped(apply(stage).findings) == dropped(apply(stage).findings) == []
