import json
from pathlib import Path

import pytest
from pxr import Sdf, Usd
from worlds import make_world

from usdface.cli import main
from usdface.fuzzy.rule_parser import parse_rule
from usdface.rule_design.paper_system import EMOTIONS
from usdface.schemas import tokens


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("resting"))
    sources = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    bind = ["--bind", folder / "bind.json", "-o", folder / "shot.usda"]
    assert main([str(a) for a in ["shot", *sources, *bind]]) == 0
    return folder / "shot.usda"


@pytest.mark.slow
def test_the_paper_is_angry_at_rest_and_the_design_is_calm(
    shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "rest.json"
    assert main(["fuzzy", "neutral", str(shot), "--report", str(report)]) == 0
    shown = capsys.readouterr().out
    assert "anger" in shown and "l_eyebrow_end_z IS low" in shown
    paper, designed = json.loads(report.read_text())["responses"]
    assert paper["neutral"] == {e: float(e == "anger") for e in EMOTIONS}
    assert len(paper["rules_firing"]) == 1
    assert designed["rules_firing"] == [] and set(designed["neutral"].values()) == {0.0}
    assert max(designed["jitter_mean"].values()) <= 0.02
    assert max(designed["jitter_max"].values()) <= 0.1


@pytest.mark.slow
def test_a_rule_that_fires_at_rest_is_heard(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = Usd.Stage.Open(str(shot))
    system = stage.GetPrimAtPath("/Shot/Fuzzy")
    rule = next(p for p in system.GetChildren() if p.GetTypeName() == tokens.FUZZY_RULE)
    parsed = parse_rule(rule.GetAttribute(tokens.RULE_TEXT).Get())
    first, (emotion, _) = parsed.propositions[0], parsed.consequents[0]
    text = f"IF {first.variable} IS NOT {first.term} THEN {emotion} IS 1"
    rule.GetAttribute(tokens.RULE_TEXT).Set(text)
    loud = shot.with_name("loud.usda")
    stage.GetRootLayer().Export(str(loud))
    assert main(["fuzzy", "neutral", str(loud), "--format", "json"]) == 0
    detected = json.loads(capsys.readouterr().out)["responses"][1]
    assert len(detected["rules_firing"]) == 1
    assert max(detected["neutral"].values()) > 0.9 and max(detected["jitter_mean"].values()) > 0.9


@pytest.mark.slow
def test_the_face_rests_whatever_the_performer_showed_in_the_neutral_frames(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A smile in the take's neutral frames is the take's; the face that is asked about has none."""
    stage = Usd.Stage.Open(str(shot))
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    smile = stage.GetPrimAtPath("/Shot/Expressions/joy").GetAttribute(tokens.SHAPES).Get()
    named = Sdf.ValueTypeNames.TokenArray, Sdf.ValueTypeNames.FloatArray
    for name, kind, value in (
        (tokens.NEUTRAL_SHAPES, named[0], smile),
        (tokens.NEUTRAL_WEIGHTS, named[1], [0.5] * len(smile)),
    ):
        retarget.CreateAttribute(name, kind).Set(value)
    smiling = shot.with_name("smiling.usda")
    stage.GetRootLayer().Export(str(smiling))
    assert main(["fuzzy", "neutral", str(smiling), "--format", "json"]) == 0
    responses = json.loads(capsys.readouterr().out)["responses"]
    assert max(responses[1]["jitter_mean"].values()) <= 0.02


def test_a_shot_without_a_system_is_one_line(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = Usd.Stage.Open(str(shot))
    stage.GetPrimAtPath("/Shot/Retarget").GetRelationship(tokens.SYSTEM).ClearTargets(True)
    bare = shot.with_name("bare.usda")
    stage.GetRootLayer().Export(str(bare))
    assert main(["fuzzy", "neutral", str(bare)]) == 1
    assert "no fuzzy system" in capsys.readouterr().err
