"""The head's motion on the stage; what else the layers hold is in tests/test_pipeline.py."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel
from worlds import make_world, restaged

from usdface.cli import main

_OP = "xformOp:transform:usdfaceHead"


def processed(
    folder: Path, *flags: str, unit: tuple[float, str] = (1.0, "Y"), **bind: object
) -> Usd.Stage:
    world = make_world()
    world.write(folder, **bind)
    if unit != (1.0, "Y"):
        restaged(folder / "rig.usda", *unit)
    names = {name: str(folder / f"{name}.usda") for name in ("rig", "take", "shot")}
    shot = ["--rig", names["rig"], "--take", names["take"], "--bind", str(folder / "bind.json")]
    assert main(["shot", *shot, "-o", names["shot"]]) == 0
    assert main(["process", names["shot"], "--no-express", *flags]) == 0
    return Usd.Stage.Open(str(folder / "shot.usdface.usda"))


def skel_root(stage: Usd.Stage) -> Usd.Prim:
    return next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))


def to_world(prim: Usd.Prim, code: float) -> np.ndarray:
    return np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))


@pytest.mark.parametrize("unit", [(1.0, "Y"), (0.01, "Z")])
def test_the_character_moves_with_the_markers(tmp_path: Path, unit: tuple[float, str]) -> None:
    """The performer is the character: its face, moved, is where the markers are."""
    stage = processed(tmp_path, unit=unit, move_head=True)
    root, take = skel_root(stage), stage.GetPrimAtPath("/Shot/Capture/Take")
    solved = stage.GetPrimAtPath("/Shot/Retarget")
    rest = np.linalg.inv(to_world(root, Usd.TimeCode.Default()))
    furthest = 0.0
    for code in take.GetAttribute("points").GetTimeSamples():
        face = np.array(solved.GetAttribute("usdface:featurePoints").Get(code))
        moved = face @ rest[:3, :3] + rest[3, :3]
        there = to_world(root, code)
        moved = moved @ there[:3, :3] + there[3, :3]
        place = to_world(take, code)
        markers = np.array(take.GetAttribute("points").Get(code)) @ place[:3, :3] + place[3, :3]
        np.testing.assert_allclose(moved * unit[0], markers * unit[0], atol=2e-5)
        furthest = max(furthest, float(np.abs(moved - face).max()) * unit[0])
    assert furthest > 0.008


def test_a_character_that_stands_elsewhere_keeps_its_own_transform(tmp_path: Path) -> None:
    stage = processed(tmp_path, move_head=True)
    prims = UsdGeom.Xformable(skel_root(stage)).GetXformOpOrderAttr()
    assert list(prims.Get()) == [_OP]
    rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    UsdGeom.Xformable(skel_root(rig)).AddTranslateOp().Set((1.0, 2.0, 3.0))
    rig.Save()
    assert main(["process", str(tmp_path / "shot.usda"), "--no-express"]) == 0
    again = Usd.Stage.Open(str(tmp_path / "shot.usdface.usda"))
    root = skel_root(again)
    order = UsdGeom.Xformable(root).GetXformOpOrderAttr().Get()
    assert list(order) == ["xformOp:translate", _OP]
    np.testing.assert_allclose(to_world(root, 0.0)[3, :3], [1.0, 2.0, 3.0], atol=1e-4)


def test_muted_it_stands_still_again(tmp_path: Path) -> None:
    stage = processed(tmp_path, move_head=True)
    solve = next(x for x in stage.GetUsedLayers() if x.realPath.endswith("solve.usdc"))
    stage.MuteLayer(solve.identifier)
    np.testing.assert_array_equal(to_world(skel_root(stage), 20.0), np.eye(4))


def test_the_character_stays_where_nobody_asked_it_to_move(tmp_path: Path) -> None:
    stage = processed(tmp_path)
    root = skel_root(stage)
    assert not root.HasAttribute(_OP)
    assert not UsdGeom.Xformable(root).TransformMightBeTimeVarying()


def test_gltf_says_that_the_head_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    processed(tmp_path, "--gltf", str(tmp_path / "a.glb"), move_head=True)
    assert "the motion of the head is left out of glTF" in capsys.readouterr().out
