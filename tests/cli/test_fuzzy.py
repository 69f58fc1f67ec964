import json
from pathlib import Path

import pytest
from pxr import Usd
from worlds import make_world

from usdface.cli import main
from usdface.fuzzy.rule_parser import parse_rule
from usdface.schemas import tokens


@pytest.fixture(scope="module")
def eager(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot, one of whose rules fires on a neutral face: a warning as it is explained."""
    folder = make_world().write(tmp_path_factory.mktemp("eager"))
    files = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    bind = ["--bind", folder / "bind.json", "-o", folder / "shot.usda"]
    assert main([str(word) for word in ["shot", *files, *bind]]) == 0
    stage = Usd.Stage.Open(str(folder / "shot.usda"))
    rule = next(p for p in stage.Traverse() if p.GetTypeName() == tokens.FUZZY_RULE)
    text = rule.GetAttribute(tokens.RULE_TEXT)
    first = parse_rule(text.Get()).propositions[0]
    text.Set(f"IF {first.variable} IS NOT {first.term} THEN joy IS 1")
    stage.GetRootLayer().Export(str(folder / "eager.usda"))
    return folder / "eager.usda"


def test_explain_prints_findings_and_strict_fails_by_them(
    eager: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fuzzy", "explain", str(eager), "--frame", "3"]
    assert main(command) == 0
    assert "\nwarning RULE_FIRES_AT_NEUTRAL: " in capsys.readouterr().out
    assert main([*command, "--format", "json", "--strict"]) == 1
    printed = json.loads(capsys.readouterr().out)
    assert "RULE_FIRES_AT_NEUTRAL" in {each["code"] for each in printed["findings"]}
    assert printed["frame"] == 3


def test_neutral_has_the_responses_in_its_report(
    eager: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "report.json"
    assert main(["fuzzy", "neutral", str(eager), "--report", str(report)]) == 0
    assert f"wrote {report}" in capsys.readouterr().out
    written = json.loads(report.read_text())
    paper, own = written["responses"]
    assert own["neutral"]["joy"] == paper["neutral"]["anger"] == 1.0
    assert written["written"] == [str(report)]
