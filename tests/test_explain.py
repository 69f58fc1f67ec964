import json
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd
from worlds import animation_of, make_world

from usdface.cli import main
from usdface.explain import Explanation
from usdface.pipeline import explain
from usdface.schemas import tokens

FRAME = 25


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("explain"))
    sources = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    bind = ["--bind", folder / "bind.json", "-o", folder / "shot.usda"]
    assert main([str(a) for a in ["shot", *sources, *bind]]) == 0
    return folder / "shot.usda"


@pytest.fixture(scope="module")
def explained(shot: Path) -> Explanation:
    return explain(shot)


def test_it_explains_what_process_writes(shot: Path, explained: Explanation) -> None:
    assert main(["process", str(shot)]) == 0
    root = shot.with_name("shot.usdface.usda")
    stage = Usd.Stage.Open(str(root))
    played = animation_of(root).reordered(explained.shapes)
    np.testing.assert_allclose(explained.corrected, played.weights, atol=1e-6)
    system = stage.GetPrimAtPath("/Shot/Fuzzy")
    for name, curve in zip(explained.system.emotions, explained.outputs.T, strict=True):
        attribute = system.GetAttribute(tokens.EMOTION_PREFIX + name)
        authored = [attribute.Get(code) for code in attribute.GetTimeSamples()]
        np.testing.assert_allclose(curve, authored, atol=1e-6)


def test_a_frame_adds_up(explained: Explanation) -> None:
    """One rule for each emotion: what fires is what answers, and only its weights move."""
    facts = explained.frame(FRAME)
    fired = [rule for rule in facts["rules"] if rule["fires"] > 0]
    assert fired and fired == facts["rules"][: len(fired)]
    strongest = max(facts["emotions"], key=facts["emotions"].get)
    assert f"THEN {strongest}" in fired[0]["rule"]
    names = [feature["name"] for feature in facts["features"]]
    assert names == [variable.name for variable in explained.system.inputs]
    for change in facts["weights"].values():
        assert change["corrected"] > change["solved"], "the mode is raise"


def test_a_neutral_frame_has_nothing_to_explain(explained: Explanation) -> None:
    facts = explained.frame(0)
    assert not any(facts["emotions"].values()) and not facts["weights"]
    assert not any(rule["fires"] for rule in facts["rules"])


def test_the_command_prints_text_and_json(
    shot: Path, explained: Explanation, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fuzzy", "explain", str(shot), "--frame", str(FRAME)]
    report = tmp_path / "frame.json"
    assert main([*arguments, "--report", str(report)]) == 0
    assert "rules that fire" in capsys.readouterr().out
    assert main([*arguments, "--format", "json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(report.read_text()) == explained.frame(FRAME)


def test_a_frame_that_is_not_there_is_one_line(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fuzzy", "explain", str(shot), "--frame", "4000"]) == 1
    assert capsys.readouterr().err.startswith("usdface: there is no frame 4000")


def test_a_shot_without_a_system_is_one_line(
    shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bare = shot.with_name("bare.usda")
    stage = Usd.Stage.Open(str(shot))
    stage.GetPrimAtPath("/Shot/Retarget").GetRelationship(tokens.SYSTEM).ClearTargets(True)
    stage.GetRootLayer().Export(str(bare))
    assert main(["fuzzy", "explain", str(bare)]) == 1
    assert "no fuzzy system" in capsys.readouterr().err
