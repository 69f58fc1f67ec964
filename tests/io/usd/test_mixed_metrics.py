"""Layers in other units than their stage are announced: USD does not convert them."""

from pathlib import Path

import pytest
from pxr import Usd, UsdGeom
from sheets import sheet

from usdface.findings import Finding
from usdface.io.usd.rig import rig_of_stage


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


def test_a_root_layer_without_units_is_announced(tmp_path: Path) -> None:
    sheet().Export(str(tmp_path / "head.usda"))
    stage = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    stage.GetRootLayer().subLayerPaths = ["./head.usda"]
    assert ("UNITS_ASSUMED", 1.0) in assumed(rig_of_stage(stage)[1])
