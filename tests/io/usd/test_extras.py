"""The assetInfo of a scene: its own, or that of the one character which it references."""

from pathlib import Path

from pxr import Usd, UsdGeom
from sheets import sheet

from usdface.io.usd.rig import rig_of_stage


def shot(folder: Path, characters: int) -> Usd.Stage:
    """A stage that references a character with assetInfo, as often as asked for."""
    model = sheet()
    model.SetDefaultPrim(model.GetPrimAtPath("/R"))
    model.GetDefaultPrim().SetAssetInfoByKey("copyright", "(c) A")
    model.GetRootLayer().Export(str(folder / "model.usda"))
    stage = Usd.Stage.CreateNew(str(folder / "shot.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    stage.SetDefaultPrim(stage.DefinePrim("/Shot", "Xform"))
    for number in range(characters):
        stage.DefinePrim(f"/Shot/C{number}").GetReferences().AddReference("./model.usda")
    return stage


def ignored(stage: Usd.Stage) -> list[str]:
    found = [f for f in rig_of_stage(stage)[1] if f.code == "CHANNEL_IGNORED"]
    return [channel for each in found for channel in each.values["channels"]]


def test_a_shot_has_the_asset_of_its_character(tmp_path: Path) -> None:
    stage = shot(tmp_path, 1)
    assert rig_of_stage(stage)[0].asset == {"copyright": "(c) A"}
    assert ignored(stage) == []


def test_its_own_counts_more(tmp_path: Path) -> None:
    stage = shot(tmp_path, 1)
    stage.GetDefaultPrim().SetAssetInfoByKey("name", "shot")
    assert rig_of_stage(stage)[0].asset == {"name": "shot"}
    assert ignored(stage) == ["/Shot/C0 assetInfo"]


def test_those_of_several_characters_are_announced(tmp_path: Path) -> None:
    stage = shot(tmp_path, 2)
    assert rig_of_stage(stage)[0].asset == {}
    assert ignored(stage) == ["/Shot/C0 assetInfo", "/Shot/C1 assetInfo"]
