"""Emotions beyond six are data: from a file to the shot, heard, explained, corrected."""

import json
from pathlib import Path

import numpy as np
import pytest

from usdface.cli import main
from usdface.face.expression_poses import expressions_for
from usdface.io.bind_file import read_bind
from usdface.io.expressions_file import read_expressions_file
from usdface.io.usd.rig import read_rig
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.io.usd.take_write import write_take
from usdface.pipeline import explain
from usdface.takes import MarkerTake

EXAMPLES = Path(__file__).parents[1] / "examples"
RATE = 30.0
HALF = 0.6


@pytest.fixture(scope="module")
def face():
    rig, _ = read_rig(EXAMPLES / "head.usdc")
    setup, _ = read_bind(EXAMPLES / "bind.json")
    return rig.mesh(setup.binding.mesh), setup


def perform(face, poses, place):
    """Record each pose at `HALF` for a second, with a second of rest around; return its peaks."""
    mesh, setup = face
    ease = np.sin(np.linspace(0, np.pi / 2, 15)) ** 2
    envelope = HALF * np.concatenate([ease, np.ones(30), ease[::-1], np.zeros(30)])
    weights = np.concatenate(
        [np.zeros((31, len(mesh.shapes))), *(envelope[:, None] * poses[:, None])]
    )
    points = setup.binding.points
    moved = np.tensordot(weights, mesh.offsets_at(points), axes=(1, 0))
    times = np.arange(len(weights)) / RATE
    write_take(MarkerTake(setup.binding.markers, times, mesh.points[points] + moved, RATE), place)
    return [31 + 90 * i + 30 for i in range(len(poses))]


def own_shot(folder, face, file):
    """Make a shot of the expressions of a file, with a take that plays those that are its own."""
    mesh, _ = face
    given = read_expressions_file(file)
    expressions, _ = expressions_for(mesh.shape_names, given)
    own = [e for e in expressions if e.name in given]
    poses = np.array([e.pose(mesh.shape_names) for e in own])
    peaks = perform(face, poses, folder / "take.usda")
    arguments = ["shot", "--rig", EXAMPLES / "head.usdc", "--take", folder / "take.usda"]
    arguments += ["--bind", EXAMPLES / "bind.json", "--expressions", file, "--neutral", "0", "25"]
    assert main([str(a) for a in (*arguments, "-o", folder / "shot.usda")]) == 0
    return own, peaks


@pytest.mark.slow
@pytest.mark.parametrize("name", ["contempt", "plutchik", "vrm"])
def test_emotions_of_a_file_are_designed_heard_explained_and_corrected(
    tmp_path, face, name, capsys
):
    own, peaks = own_shot(tmp_path, face, EXAMPLES / "expressions" / f"{name}.json")
    explained = explain(tmp_path / "shot.usda").value
    for expression, peak in zip(own, peaks, strict=True):
        detected = dict(
            zip(explained.system.emotions, explained.whole.evaluation.outputs[peak], strict=True)
        )
        assert max(detected, key=detected.get) == expression.name, detected
        assert detected[expression.name] == pytest.approx(HALF, abs=0.15)
        shape = expression.shapes[int(expression.weights.argmax())]
        moved = explained.frame(peak)["weights"][shape]
        assert moved["corrected"] > moved["solved"] + 0.1
    capsys.readouterr()
    assert main(["process", str(tmp_path / "shot.usda"), "--format", "json"]) == 0
    summary = json.loads(capsys.readouterr().out)["summary"]
    assert {expression.name for expression in own} <= set(summary["emotion_peaks"])


def test_a_studio_may_have_its_own_list_only(tmp_path, face):
    """The names say nothing to anybody; three of the six are left out."""
    file = tmp_path / "list.json"
    left_out = dict.fromkeys(("joy", "sadness", "anger", "fear", "disgust", "surprise"))
    sly = {"shapes": {"mouthSmileLeft": 0.5, "browDownLeft": 0.9}}
    file.write_text(json.dumps(left_out | {"sly": sly, "puffed": {"units": {"AU34": 1}}}))
    own_shot(tmp_path, face, file)
    shot = read_shot(open_stage(tmp_path / "shot.usda"), "shot")[0].shot
    assert shot.system.emotions == ("sly", "puffed")
    assert [e.name for e in shot.expressions] == ["sly", "puffed"]


@pytest.mark.slow
def test_a_shot_hands_its_expressions_on(tmp_path, face):
    mesh, _ = face
    file = EXAMPLES / "expressions" / "contempt.json"
    own_shot(tmp_path, face, file)
    expressions, _ = expressions_for(mesh.shape_names, read_expressions_file(file))
    again = read_expressions_file(tmp_path / "shot.usda")
    assert list(again) == [e.name for e in expressions]
    for expression in expressions:
        assert again[expression.name].shapes == expression.shapes
        np.testing.assert_allclose(again[expression.name].weights, expression.weights, atol=1e-7)


def test_a_usd_file_without_expressions_is_one_line(tmp_path, face, capsys):
    arguments = ["shot", "--rig", EXAMPLES / "head.usdc", "--take", EXAMPLES / "take.usdc"]
    arguments += ["--bind", EXAMPLES / "bind.json", "--expressions", EXAMPLES / "head.usdc"]
    assert main([str(a) for a in (*arguments, "-o", tmp_path / "shot.usda")]) == 1
    assert "has no UsdFaceExpression" in capsys.readouterr().err
    assert not (tmp_path / "shot.usda").exists()
