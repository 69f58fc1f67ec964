"""Layers in other units than their stage are announced: USD does not convert them."""

from pathlib import Path

import pytest
from processed import shoot
from pxr import Usd, UsdGeom
from sheets import sheet
from worlds import make_world

from usdface.findings import Finding
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.shot import read_shot


def assembled(folder: Path, scale: float = 1.0, unit: float = 1.0) -> Usd.Stage:
    """A stage in metres, Y up, that references a head in another unit and with Z up."""
    sheet(unit=unit, up="Z").Export(str(folder / "head.usda"))
    stage = Usd.Stage.CreateNew(str(folder / "shot.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    head = UsdGeom.Xform.Define(stage, "/Hero")
    if scale != 1:
        head.AddScaleOp().Set((scale,) * 3)
    stage.DefinePrim("/Hero/Head").GetReferences().AddReference("./head.usda", "/R")
    return stage


def assumed(found: list[Finding]) -> list[tuple[str, object]]:
    return [(f.code, f.values["value"]) for f in found if "layer" in f.values]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"unit": 0.01}, [("METRICS_MIXED", 0.01), ("METRICS_MIXED", "Z")]),
        ({"unit": 1.0}, [("METRICS_MIXED", "Z")]),
        ({"unit": 0.01, "scale": 0.01}, []),
    ],
)
def test_a_head_that_is_not_converted_is_announced(
    tmp_path: Path, given: dict[str, float], expected: list[tuple[str, object]]
) -> None:
    assert assumed(rig_of_stage(assembled(tmp_path, **given))[1]) == expected


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ('metersPerUnit = 0.01\n upAxis = "Z"', [("METRICS_MIXED", 1.0), ("METRICS_MIXED", "Y")]),
        ('metersPerUnit = 1\n upAxis = "Y"', []),
        ("metersPerUnit = 1", []),
        ('upAxis = "Z"', [("METRICS_MIXED", "Y"), ("UNITS_ASSUMED", 1.0)]),
    ],
)
def test_a_layer_over_a_shot_with_other_metrics_is_announced(
    tmp_path: Path, given: str, expected: list[tuple[str, object]]
) -> None:
    """USD reads them of the root layer alone: the markers are elsewhere, and lie on their backs."""
    shoot(make_world().write(tmp_path))
    over = tmp_path / "over.usda"
    over.write_text(f"#usda 1.0\n(\n {given}\n subLayers = [@shot.usda@]\n)\n")
    found = read_shot(Usd.Stage.Open(str(over)), "over.usda")[1]
    assert {(c, v) for c, v in assumed(found) if c != "RATE_ASSUMED"} == {*expected}


def test_a_root_layer_without_units_is_announced(tmp_path: Path) -> None:
    sheet().Export(str(tmp_path / "head.usda"))
    stage = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    stage.GetRootLayer().subLayerPaths = ["./head.usda"]
    assert ("UNITS_ASSUMED", 1.0) in assumed(rig_of_stage(stage)[1])
