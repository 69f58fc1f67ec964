"""Correcting the solved weights of a shot again, with other gains."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processed import run, shoot
from pxr import Usd
from worlds import make_world

from usdface.cli import main
from usdface.errors import InputError
from usdface.options import ProcessOptions
from usdface.pipeline import apply, process
from usdface.shot.correct import correct
from usdface.shot.shot import ShotResult


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(make_world().write(tmp_path_factory.mktemp("correct")))


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot whose solve has findings: a marker is hidden for some frames."""
    world = make_world()
    positions = world.take.positions.copy()
    positions[20:23, 0] = np.nan
    take = replace(world.take, positions=positions)
    return shoot(replace(world, take=take).write(tmp_path_factory.mktemp("hidden")))


@pytest.fixture(scope="module")
def result(shot: Path) -> ShotResult:
    return process(shot).value


def test_corrected_again_it_is_the_same(result: ShotResult) -> None:
    again = correct(result)
    np.testing.assert_array_equal(again.weights.weights, result.weights.weights)
    assert {f.code for f in again.findings} <= {f.code for f in result.findings}


def test_a_gain_is_that_of_the_prim(shot: Path, result: ShotResult, tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    for emotion, gain in {"joy": 0.3, "surprise": 0.0}.items():
        stage.GetPrimAtPath(f"/Shot/Expressions/{emotion}").GetAttribute("usdface:gain").Set(gain)
    other = tmp_path / "other.usda"
    stage.GetRootLayer().Export(str(other))
    text = other.read_text()
    for name in ("rig.usda", "take.usda"):
        text = text.replace(f"@./{name}@", f"@{shot.parent / name}@")
    other.write_text(text.replace("@rig.usda@", f"@{shot.parent / 'rig.usda'}@"))
    authored = process(other).value
    given = correct(result, options=ProcessOptions(gains={"joy": 0.3, "surprise": 0.0}))
    np.testing.assert_allclose(given.weights.weights, authored.weights.weights, atol=1e-7)
    assert np.abs(given.weights.weights - result.weights.weights).max() > 0.05


def test_without_the_layers_it_is_the_solve(result: ShotResult) -> None:
    plain = correct(result, options=ProcessOptions(express=False, closure=False))
    np.testing.assert_array_equal(plain.weights.weights, result.solved.weights)
    assert not plain.emotions


def test_an_unknown_emotion_or_gain_is_one_line(result: ShotResult) -> None:
    with pytest.raises(InputError, match="did you mean joy"):
        correct(result, options=ProcessOptions(gains={"jy": 1.0}))
    with pytest.raises(InputError, match="gain of joy"):
        ProcessOptions(gains={"joy": -1.0})


@pytest.mark.slow
def test_process_corrects_an_earlier_result_again(shot: Path, result: ShotResult) -> None:
    """The layers hold what the command with these gains writes, byte for byte."""
    softer = ProcessOptions(gains={"joy": 0.3})
    again = process(shot, options=softer, solved=result)
    layers = [path.read_bytes() for path in again.written]
    assert "solve" not in again.seconds
    run("process", shot, "--gains", "joy=0.3")
    assert [path.read_bytes() for path in again.written] == layers
    assert again.value.weights.weights.max() < result.weights.weights.max() + 1e-9
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    applied = apply(stage, options=softer, solved=result)
    np.testing.assert_array_equal(applied.value.weights.weights, again.value.weights.weights)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "now"),
    [
        ({}, {}),
        ({"exaggeration": {"mouth": 1.5, "eyes": 0.6}}, {"exaggeration": {"mouth": 1.5}}),
        ({"exaggeration": {"mouth": 1.5}}, {}),
        ({"express": False, "closure": False}, {"gains": {"joy": 0.5}, "head": False}),
    ],
)
def test_with_an_earlier_result_it_is_what_it_is_without(
    hidden: Path, before: dict[str, Any], now: dict[str, Any]
) -> None:
    """Weights, head, findings and report, whatever the options of the earlier run."""
    earlier = process(hidden, options=ProcessOptions(**before)).value
    options = ProcessOptions(**now)
    fresh, again = (
        process(hidden, options=options),
        process(hidden, solved=earlier, options=options),
    )
    assert {"MARKER_OCCLUDED", "MARKER_FILLED"} <= {found.code for found in fresh.findings}
    assert again.findings == fresh.findings
    assert again.summary == fresh.summary and again.details == fresh.details
    assert again.value.findings == fresh.value.findings
    np.testing.assert_array_equal(again.value.solved.weights, fresh.value.solved.weights)
    np.testing.assert_array_equal(again.value.weights.weights, fresh.value.weights.weights)
    assert (again.value.head_motion is None) == (fresh.value.head_motion is None)


def test_a_correction_knows_the_weights_before_exaggeration(shot: Path) -> None:
    larger = ProcessOptions(exaggeration={"mouth": 1.5})
    first = process(shot, options=larger).value
    np.testing.assert_array_equal(first.performed.weights, process(shot).value.solved.weights)
    np.testing.assert_array_equal(correct(first).weights.weights, first.weights.weights)
    by_hand = replace(first, solve=None)
    np.testing.assert_array_equal(by_hand.performed.weights, first.performed.weights)


def test_the_result_of_another_shot_is_refused(result: ShotResult, tmp_path: Path) -> None:
    other = shoot(make_world(rate=24.0).write(tmp_path))
    with pytest.raises(InputError, match="another take or rig"):
        process(other, solved=result)


def test_the_result_of_a_take_that_was_recorded_again_is_refused(
    shot: Path, result: ShotResult
) -> None:
    """Of as many frames, at the same times."""
    world = make_world()
    positions = world.take.positions.copy()
    positions[30, 0, 1] += 1e-3
    take = replace(world.take, positions=positions)
    path = shoot(replace(world, take=take).write(shot.parent / "again"))
    with pytest.raises(InputError, match="another take or rig"):
        process(path, solved=result)


def test_the_result_of_other_settings_of_the_solve_is_refused(
    shot: Path, result: ShotResult
) -> None:
    with pytest.raises(InputError, match="solved with other settings"):
        process(shot, solved=result, options=ProcessOptions(solve="frame"))
    with pytest.raises(InputError, match="holds no solve"):
        process(shot, solved=replace(result, solve=None))


def test_gains_on_the_command_line_name_an_emotion(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", str(shot), "--gains", "0.5"]) == 1
    assert "--gains 0.5: expected joy=0.5" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        (["--exaggeration", "1,2"], "--exaggeration 1,2: expected the factor of the face before"),
        (["--exaggeration", "brows=1,2"], "decimals with a point"),
        (["--exaggeration", "mouth=1.2,mouth=0.5"], "mouth occurs twice"),
        (["--gains", "joy=0.5,joy=1"], "joy occurs twice"),
    ],
)
def test_a_factor_is_given_once(
    factors: list[str], message: str, shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """1,2 was a factor of 1, then one of 2, which played the face twice as large."""
    assert main(["process", str(shot), *factors]) == 1
    assert message in capsys.readouterr().err
