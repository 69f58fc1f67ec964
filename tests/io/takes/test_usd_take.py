from pathlib import Path

import pytest
from pxr import Usd, UsdSkel
from worlds import make_world

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions


def test_a_take_in_usd_is_read(tmp_path: Path) -> None:
    world = make_world()
    world.write(tmp_path)
    take, _ = read_take(tmp_path / "take.usda")
    assert take.names == world.take.names


def test_it_names_its_own_units(tmp_path: Path) -> None:
    make_world().write(tmp_path)
    with pytest.raises(InputError, match="USD has no use for units = 'mm'"):
        read_take(tmp_path / "take.usda", TakeOptions(units="mm"))


@pytest.mark.parametrize("name", ["none.usda", "rig.usda", "none.mov"])
def test_what_is_no_take_is_refused(tmp_path: Path, name: str) -> None:
    make_world().write(tmp_path)
    with pytest.raises(InputError):
        read_take(tmp_path / name)


def test_motion_of_joints_that_a_take_of_weights_lacks_is_announced(tmp_path: Path) -> None:
    """As of a SkelAnimation that another program wrote of a whole head."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "take.usda"))
    animation = UsdSkel.Animation.Define(stage, "/Take")
    animation.CreateBlendShapesAttr(["jawOpen"])
    for code, value in ((0.0, 0.0), (1.0, 1.0)):
        animation.CreateBlendShapeWeightsAttr().Set([value], code)
    animation.CreateJointsAttr(["neck", "neck/head"])
    animation.CreateTranslationsAttr([(0, 0, 0), (0, 1, 0)])
    stage.SetDefaultPrim(animation.GetPrim())
    stage.Save()
    assert read_take(tmp_path / "take.usda")[1] == []
    for code, height in ((0.0, 1.0), (1.0, 2.0)):
        animation.GetTranslationsAttr().Set([(0, 0, 0), (0, height, 0)], code)
    stage.Save()
    (lost,) = read_take(tmp_path / "take.usda")[1]
    assert lost.code == "CHANNEL_IGNORED"
    assert lost.values["channels"] == ["neck", "neck/head"]
