"""Units and clocks: what a layer over a shot leaves unsaid."""

from pathlib import Path

import pytest
from pxr import Usd

from usdface.io.usd.metrics import metrics_of, missing_metrics

BELOW = '#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"\n timeCodesPerSecond = 60\n)\n'


@pytest.mark.parametrize(
    ("message", "codes"),
    [
        ("", ["UNITS_ASSUMED", "UP_AXIS_ASSUMED", "RATE_ASSUMED"]),
        (' metersPerUnit = 0.01\n upAxis = "Z"\n timeCodesPerSecond = 24\n', []),
        (' upAxis = "Z"\n framesPerSecond = 60\n', ["UNITS_ASSUMED"]),
    ],
)
def test_what_a_layer_leaves_to_usds_fallback_against_the_shot_below_is_said(
    tmp_path: Path, message: str, codes: list[str]
) -> None:
    (tmp_path / "shot.usda").write_text(BELOW)
    over = tmp_path / "over.usda"
    over.write_text(f"#usda 1.0\n(\n{message} subLayers = [@shot.usda@]\n)\n")
    stage = Usd.Stage.Open(str(over))
    found = missing_metrics(stage)
    assert [f.code for f in found] == codes
    assert all(f.where == "over.usda" and "shot.usda" in f.message for f in found)
    if codes:
        assert metrics_of(stage).meters_per_unit == 0.01 and "has 1.0: copy it" in found[0].message


def test_a_layer_alone_leaves_nothing_unsaid(tmp_path: Path) -> None:
    (tmp_path / "bare.usda").write_text("#usda 1.0\n")
    assert not missing_metrics(Usd.Stage.Open(str(tmp_path / "bare.usda")))
