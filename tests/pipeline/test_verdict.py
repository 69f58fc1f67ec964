"""The verdict at the end of `process`: on screen, in JSON, and as a refusal."""

import json
from pathlib import Path

import pytest
from processed import digests, shoot
from worlds import make_world

from usdface.cli import main
from usdface.io.usd.played_shot import read_played_shot
from usdface.io.usd.stage import open_stage
from usdface.page.shot_data import shot_data
from usdface.verdict import Measured


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("verdict")
    return shoot(make_world().write(folder))


@pytest.fixture
def spoilt(monkeypatch: pytest.MonkeyPatch) -> None:
    measured = {"PLACES_MISFIT": Measured(0.9, "markers", ("chin", "[red]brow"))}
    monkeypatch.setattr("usdface.shot.report.shot_measures", lambda *_: measured)


def test_the_verdict_is_the_last_thing_on_screen(
    shot: Path, spoilt: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", str(shot)]) == 0
    *_, verdict, reason, remedy = capsys.readouterr().out.splitlines()
    assert verdict == "verdict: not usable"
    assert reason.startswith("  PLACES_MISFIT: ") and "90%" in reason and "[red]brow" in reason
    assert "usdface shot" in remedy


def test_the_verdict_is_plain_values_in_json(
    shot: Path, spoilt: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", str(shot), "--format", "json"]) == 0
    verdict = json.loads(capsys.readouterr().out)["verdict"]
    assert verdict["level"] == "not_usable"
    assert verdict["reasons"][0]["markers"] == ["chin", "[red]brow"]


def test_strict_writes_nothing_that_is_not_usable(
    shot: Path, spoilt: None, capsys: pytest.CaptureFixture[str]
) -> None:
    before = digests(shot.parent)
    glb, report = shot.parent / "new.glb", shot.parent / "new.json"
    options = ["--strict", "--gltf", str(glb), "--report", str(report)]
    assert main(["process", str(shot), *options]) != 0
    assert "not usable" in capsys.readouterr().err
    assert digests(shot.parent) == before


def test_the_verdict_is_in_the_solve_layer_and_on_the_page(shot: Path, spoilt: None) -> None:
    assert main(["process", str(shot)]) == 0
    root = shot.with_name("shot.usdface.usda")
    stage = open_stage(root)
    played, _ = read_played_shot(stage, str(root))
    assert played.verdict is not None and played.verdict.level == "not_usable"
    (reason,) = shot_data(played, played.rig.shape_names, played.rig.meshes)["verdict"]["reasons"]
    assert reason["message"] == played.verdict.reasons[0].message and "90%" in reason["message"]
    assert "usdface shot" in reason["remedy"]


@pytest.mark.usefixtures("as_users_have_it")
def test_a_verdict_that_fails_is_a_finding(
    shot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ValueError

    monkeypatch.setattr("usdface.shot.report.shot_measures", fail)
    assert main(["process", str(shot), "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "verdict" not in document
    assert "ADVICE_FAILED" in {finding["code"] for finding in document["findings"]}
