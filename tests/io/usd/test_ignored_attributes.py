"""What is written on our prims and counts for nothing is said."""

from pathlib import Path

import pytest
from pxr import Sdf

from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot

SHOT = Path(__file__).resolve().parents[3] / "examples" / "shot.usda"


def findings_by_place(tmp_path: Path, where: str, text: str) -> dict[str, str]:
    """Messages by place of a layer over the example's shot that has `text` in an override."""
    layer = Sdf.Layer.CreateNew(str(tmp_path / "over.usda"))
    opened = "".join(f'over "{name}" {{\n' for name in where.split("/"))
    layer.ImportFromString(
        "#usda 1.0\n(\n metersPerUnit = 1\n timeCodesPerSecond = 60\n"
        f" subLayers = [@{SHOT}@]\n)\n{opened}{text}\n" + "}\n" * (where.count("/") + 1)
    )
    layer.Save()
    stage = open_shot(tmp_path / "over.usda")
    _, findings = read_shot(stage, "over.usda")
    return {f.where: f.message for f in findings if f.code == "SETTING_UNREAD"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "text", "place", "message"),
    [
        ("Shot/Fuzzy", "float usdface:brow:gain = 0", ".usdface:brow:gain", "usdface:brows:gain?"),
        ("Shot/Fuzzy/rule_01", "float usdface:wieght = 0", ".usdface:wieght", "usdface:weight?"),
        ("Shot/Expressions/joy", "float usdface:gian = 0", ".usdface:gian", "usdface:gain?"),
        (
            "Shot/Fuzzy",
            "uniform double usdface:ease.timeSamples = {\n0: 0,\n9: 1,\n}",
            ".usdface:ease",
            "one value for the take",
        ),
        (
            "Shot/Fuzzy/rule_01",
            "float usdface:weight.timeSamples = {\n0: 0,\n9: 1,\n}",
            ".usdface:weight",
            "one value for the take",
        ),
        (
            "Shot/Fuzzy/rule_01",
            "float usdface:weight.spline = {\n0: 0; post linear,\n9: 1; post linear,\n}",
            ".usdface:weight",
            "one value for the take",
        ),
        (
            "Shot/Fuzzy/rule_01",
            "bool usdface:enabled.timeSamples = {\n0: 0,\n}",
            ".usdface:enabled",
            "one value for the take",
        ),
        (
            "Shot/Retarget",
            "rel usdface:take = [</Shot/Capture/Take>, </Shot/Character>]",
            ".usdface:take",
            "the first counts",
        ),
        (
            "Shot/Capture/Take",
            "bool[] usdface:markers:visble = []",
            ".usdface:markers:visble",
            "usdface:markers:visible?",
        ),
        ("Shot/Fuzzy/rule_07", "float usdface:weight = 0", "", "no layer defines it"),
        ("Shot/Expressions/joyy", "float usdface:gain = 0", "", "did you mean joy?"),
        (
            "Shot/Expressions",
            'def UsdFaceExpression "smug" {\n}',
            "/smug",
            "no target of usdface:expressions",
        ),
        ("Shot/Fuzzy", 'def "rule_07" {\n}', "/rule_07", "write def UsdFaceFuzzyRule"),
        ("Shot/Fuzzy", 'def UsdFaceFuzyRule "mine" {\n}', "/mine", "mean UsdFaceFuzzyRule?"),
        ("Shot/Fuzzy", 'def Scope "mine" {\n}', "/mine", "UsdFaceFuzzyRule or"),
    ],
)
def test_what_nothing_reads_is_named(
    tmp_path: Path, where: str, text: str, place: str, message: str
) -> None:
    path = f"</{where}{place}>" if place.startswith("/") else f"</{where}>{place}"
    found = findings_by_place(tmp_path, where, text)
    assert list(found) == [path] and message in found[path]


@pytest.mark.parametrize(
    ("where", "text"),
    [
        ("Shot/Fuzzy", "float usdface:gain.timeSamples = {\n0: 0,\n9: 1,\n}"),
        ("Shot/Fuzzy", "float usdface:emotion:joy = 0"),
        ("Shot/Fuzzy", "float studio:note = 0"),
        ("Shot/Retarget", "float usdface:pin:jawOpen = 0"),
        ("Shot/Retarget", "float usdface:residual:mouth = 0"),
        ("Shot/Fuzzy", 'def UsdFaceFuzzyRule "mine" {\nuniform string usdface:text = '
         '"IF lip_corner_left_y IS lowered THEN joy IS 1"\n}'),
        ("Shot/Expressions", 'def UsdFaceExpression "smug" (active = false) {\n}'),
        ("Shot/Fuzzy", 'def Scope "notes" (active = false) {\n}'),
    ],
)  # fmt: skip
def test_what_is_read_or_not_ours_is_not(tmp_path: Path, where: str, text: str) -> None:
    assert findings_by_place(tmp_path, where, text) == {}
