import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from expression_systems import changed
from pxr import Usd
from worlds import animation_of, make_world

from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.cli.print_fuzzy import print_explanation
from usdface.correction.expression_layer import SideTrace
from usdface.errors import InputError
from usdface.face.mirror import Side
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.norms import most_of
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Condition, Proposition
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.io.usd.take_write import write_take
from usdface.options import ProcessOptions
from usdface.pipeline import explain
from usdface.schemas import tokens
from usdface.setup.expression import Expression
from usdface.shot.explanation import Explanation
from usdface.takes import WeightsTake

FRAME = 25
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("explain"))
    sources = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    bind = ["--bind", folder / "bind.json", "-o", folder / "shot.usda"]
    assert main([str(a) for a in ["shot", *sources, *bind]]) == 0
    return folder / "shot.usda"


@pytest.fixture(scope="module")
def explained(shot: Path) -> Explanation:
    return explain(shot).value


def test_it_explains_what_process_writes(shot: Path, explained: Explanation) -> None:
    assert main(["process", str(shot)]) == 0
    root = shot.with_name("shot.usdface.usda")
    stage = Usd.Stage.Open(str(root))
    played = animation_of(root).reordered(explained.result.solved.names)
    np.testing.assert_allclose(explained.result.weights.weights, played.weights, atol=1e-6)
    system = stage.GetPrimAtPath("/Shot/Fuzzy")
    for name, curve in zip(
        explained.system.emotions, explained.whole.evaluation.outputs.T, strict=True
    ):
        attribute = system.GetAttribute(tokens.EMOTION_PREFIX + name)
        authored = [attribute.Get(code) for code in attribute.GetTimeSamples()]
        np.testing.assert_allclose(curve, authored, atol=1e-6)
    fired = system.GetAttribute(tokens.FIRING)
    authored = [fired.Get(code) for code in fired.GetTimeSamples()]
    np.testing.assert_allclose(explained.trace.firing, authored, atol=1e-6)


def test_a_run_with_other_options_is_explained_with_them(
    shot: Path, explained: Explanation, capsys: pytest.CaptureFixture[str]
) -> None:
    factors = ["--exaggeration", "mouth=1.3", "--no-closure"]
    root = shot.with_name("larger.usda")
    assert main(["process", str(shot), *factors, "-o", str(root)]) == 0
    stage = Usd.Stage.Open(str(root))  # held, because prims expire with it
    system = stage.GetPrimAtPath("/Shot/Fuzzy")
    capsys.readouterr()
    command = ["fuzzy", "explain", str(shot), *factors, "--frame", str(FRAME), "--format", "json"]
    assert main(command) == 0
    shown = json.loads(capsys.readouterr().out)["emotions"]
    for name, output in shown.items():
        assert output == pytest.approx(
            system.GetAttribute(tokens.EMOTION_PREFIX + name).Get(float(FRAME)), abs=1e-3
        )
    assert shown != explained.frame(FRAME)["emotions"]
    with pytest.raises(InputError, match="no correction to explain"):
        explain(shot, options=ProcessOptions(express=False))


def test_a_frame_adds_up(explained: Explanation) -> None:
    """One rule for each emotion: the first that fires and is not suppressed answers."""
    facts = explained.frame(FRAME)
    fired = [rule for rule in facts["rules"] if rule["fires"] > 0]
    assert fired and fired == facts["rules"][: len(fired)]
    strongest = max(facts["emotions"], key=facts["emotions"].get)
    detected, by_rules = facts["emotions"], facts["by_rules"]
    asked = [rule["rule"].rsplit("THEN ", 1)[1].split()[0] for rule in fired]
    assert asked[0] == max(by_rules, key=by_rules.get)
    assert strongest == next(emotion for emotion in asked if detected[emotion] >= by_rules[emotion])
    names = [feature["name"] for feature in facts["features"]]
    assert names == [variable.name for variable in explained.system.fuzzy.inputs]
    for change in facts["weights"].values():
        assert change["corrected"] > change["solved"], "the mode is raise"


def test_a_weight_names_the_emotion_that_asks_for_it(shot: Path, explained: Explanation) -> None:
    """What is shown, times the pose, is what each emotion asks for."""
    change = np.abs(explained.result.weights.weights - explained.result.solved.weights).max(axis=1)
    raised = np.where(change > 0.02, explained.whole.intensity.max(axis=1), 0.0)
    facts = explained.frame(int(raised.argmax()))
    assert change.max() > 0.02 and facts["weights"]
    poses = {e.name: dict(zip(e.shapes, e.weights, strict=True)) for e in poses_of(shot)}
    shown = facts["poses_shown"]
    for shape, weight in facts["weights"].items():
        asked = {e: shown[e] * poses[e].get(shape, 0.0) for e in poses}
        if any(asked.values()):
            assert weight["by"] == max(asked, key=asked.get)
        else:
            assert poses[weight["by"]][shape] > 0, (
                "what is blended in or out names its emotion, too"
            )
        assert weight["solved"] < weight["corrected"], "blended in, it is on its way there"
    loudest = max(facts["emotions"], key=facts["emotions"].get)
    detected, (onset, full) = explained.trace.emotions[loudest].max(), explained.system.response
    x = min((detected - onset) / (full - onset), 1.0)
    assert facts["poses_shown"][loudest] == pytest.approx(x * x * (3 - 2 * x), abs=1e-3)
    assert set(explained.frame(0)["poses_shown"].values()) == {0.0}


@pytest.fixture(scope="module")
def half_smile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's head, which smiles on its left only: recorded weights."""
    folder = tmp_path_factory.mktemp("half_smile")
    phase = np.linspace(0.0, np.pi, 61)
    weights = np.outer(np.sin(phase) ** 2, [0.6, 0.55])
    take = WeightsTake(("mouthSmileLeft", "cheekSquintLeft"), np.arange(61) / 30, weights)
    write_take(take, folder / "take.usda")
    sources = ["--rig", EXAMPLES / "head.usdc", "--take", folder / "take.usda"]
    bind = ["--bind", EXAMPLES / "bind.json", "-o", folder / "shot.usda"]
    assert main([str(a) for a in ["shot", *sources, *bind]]) == 0
    return folder / "shot.usda"


@pytest.mark.slow
def test_what_half_a_face_does_explains_what_its_shapes_do(
    half_smile: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The whole face hardly smiles, and yet half of it is raised."""
    half = explain(half_smile).value
    facts = half.frame(30)
    assert facts["poses_shown"]["joy"] == 0 and facts["emotions"]["joy"] < 0.3
    assert facts["weights"]
    assert all(w["by"] == "joy" and name.endswith("Left") for name, w in facts["weights"].items())
    assert list(facts["halves"]) == ["left"], "the right half says what the whole face says"
    assert facts["halves"]["left"]["emotions"]["joy"] > 0.5
    (fired,) = (rule for rule in facts["halves"]["left"]["rules"] if rule["fires"] > 0)
    assert fired["fires"] == pytest.approx(degree_of(fired), abs=1e-3)
    assert half.peak == 30, "the strongest emotion of a half counts where the face has none"
    figure = tmp_path / "why.svg"
    assert main(["fuzzy", "explain", str(half_smile), "--figure", str(figure)]) == 0
    assert "the left half, mirrored to the right" in capsys.readouterr().out


def degree_of(rule: dict[str, Any]) -> float:
    """Return how far a rule holds by the degrees of its conditions."""
    degrees = iter(condition["degree"] for condition in rule["conditions"])

    def of(condition: Condition) -> float:
        if isinstance(condition, Proposition):
            return next(degrees)
        parts = [of(part) for part in condition.parts]
        if condition.how == "not":
            return 1.0 - parts[0]
        return (
            float(most_of(np.array(parts)[:, None])[0]) if condition.how == "most" else min(parts)
        )

    return of(parse_rule(rule["rule"]).antecedent)


def poses_of(shot: Path) -> tuple[Expression, ...]:
    return read_shot(open_shot(shot), str(shot))[0].shot.expressions


def test_a_region_that_does_not_show_the_pose_is_named(
    explained: Explanation, capsys: pytest.CaptureFixture[str]
) -> None:
    facts = explained.frame(FRAME)
    strongest = max(facts["emotions"], key=facts["emotions"].get)
    assert strongest not in facts["held_back"] and facts["poses_shown"][strongest] > 0
    column = np.array([[name == strongest for name in explained.system.emotions]])
    missing = {"mouth": np.repeat(column, len(explained.times), axis=0)}
    sides = {"both": replace(explained.whole, missing=missing)}
    held = replace(explained, trace=replace(explained.trace, sides=sides)).frame(FRAME)
    assert held["held_back"] == {strongest: ["mouth"]}
    print_explanation(held)
    assert f"{strongest} is held back: not shown in mouth" in capsys.readouterr().out


def test_the_peak_is_an_emotion_that_the_frame_lists(explained: Explanation) -> None:
    """A half that shows what the whole face shows is not listed, however strong its emotions."""
    whole = explained.whole
    quiet = replace(whole, intensity=np.zeros_like(whole.intensity))
    louder = np.zeros_like(whole.evaluation.outputs)
    louder[3] = whole.evaluation.outputs.max() + 0.1
    half = replace(quiet, evaluation=replace(quiet.evaluation, outputs=louder))
    held = with_sides(explained, {"both": quiet, "left": half})
    assert not held.frame(3)["halves"]
    assert held.peak == int(whole.evaluation.outputs.max(axis=1).argmax())
    intensity = np.zeros_like(whole.intensity)
    intensity[3] = 0.5
    listed = with_sides(explained, {"both": quiet, "left": replace(half, intensity=intensity)})
    assert list(listed.frame(3)["halves"]) == ["left"]
    assert listed.peak == 3


def with_sides(explained: Explanation, sides: Mapping[Side, SideTrace]) -> Explanation:
    """Return an explanation with other sides."""
    return replace(explained, trace=replace(explained.trace, sides=sides))


def test_a_neutral_frame_has_nothing_to_explain(explained: Explanation) -> None:
    facts = explained.frame(0)
    assert not any(facts["emotions"].values()) and not facts["weights"]
    assert facts["nothing_fires"] and not any(rule["fires"] for rule in facts["rules"])


def test_the_conditions_of_a_rule_say_why_it_fires(explained: Explanation) -> None:
    """AND is the smaller, MOST OF counts, and millimetres are those between the markers."""
    assert explained.system.fuzzy.and_ == "min" and explained.system.space == "character"
    facts = explained.frame(FRAME)
    for rule in facts["rules"]:
        assert rule["fires"] == pytest.approx(rule["weight"] * degree_of(rule), abs=1e-3)
    world = make_world()
    names = list(world.take.names)
    for feature in facts["features"]:
        assert feature["measured_to"] == "nose" and feature["marker"] in names
    moved = {f["name"]: f["mm"] for f in facts["features"]}
    for condition in facts["rules"][0]["conditions"]:
        assert condition["mm"] == moved[condition["variable"]] != 0
    # What the solved weights do to the vertices where the markers sit, without noise.
    mesh = world.rig.meshes[0]
    pose = dict(
        zip(explained.result.solved.names, explained.result.solved.weights[FRAME], strict=True)
    )
    weights = np.array([pose[name] for name in mesh.shape_names])

    def offset(marker: str) -> FloatArray:
        return 1000 * weights @ mesh.offsets_at(np.array([world.points[marker]]))[:, 0]

    for feature in facts["features"]:
        change = (offset(feature["marker"]) - offset("nose"))["xyz".index(feature["axis"])]
        assert feature["mm"] == pytest.approx(change, abs=0.01)


def test_hedges_count_in_conditions(explained: Explanation) -> None:
    rule = explained.system.fuzzy.rules[0]
    hedged = parse_rule(rule.text.replace(" IS ", " IS NOT VERY ", 1))
    whole, system = explained.whole, changed(explained.system, rules=(hedged,))
    evaluation = evaluate(system.fuzzy, whole.inputs, memberships=True)
    trace = replace(
        explained.trace, system=system, sides={"both": replace(whole, evaluation=evaluation)}
    )
    (plain,) = (r for r in explained.frame(FRAME)["rules"] if r["rule"] == rule.text)
    (found,) = replace(explained, trace=trace).frame(FRAME)["rules"]
    assert found["conditions"][0]["is"].startswith("not very ")
    degree = plain["conditions"][0]["degree"]
    assert found["conditions"][0]["degree"] == pytest.approx(1 - degree**2, abs=1e-3)


@pytest.mark.slow
def test_a_time_is_a_frame(
    shot: Path, explained: Explanation, capsys: pytest.CaptureFixture[str]
) -> None:
    rate = 1 / float(np.diff(explained.times).mean())
    seconds = explained.times[FRAME] + 0.4 / rate
    assert explained.frame_at(seconds) == FRAME
    arguments = ["fuzzy", "explain", str(shot), "--format", "json"]
    assert main([*arguments, "--time", str(seconds)]) == 0
    assert explained.frame(FRAME).items() <= json.loads(capsys.readouterr().out).items()
    assert main(arguments) == 0
    loudest = json.loads(capsys.readouterr().out)
    assert loudest["frame"] == explained.peak
    assert max(loudest["emotions"].values()) == pytest.approx(
        explained.whole.evaluation.outputs.max(), abs=1e-4
    )
    for wrong in ("-1", "1e9", "nan"):
        assert main(["fuzzy", "explain", str(shot), f"--time={wrong}"]) == 1
        assert "the take goes from 0 to" in capsys.readouterr().err


def test_the_command_prints_text_and_json(
    shot: Path, explained: Explanation, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fuzzy", "explain", str(shot), "--frame", str(FRAME)]
    report = tmp_path / "frame.json"
    assert main([*arguments, "--report", str(report)]) == 0
    assert "rules that fire" in capsys.readouterr().out
    assert main([*arguments, "--format", "json"]) == 0
    printed, written = json.loads(capsys.readouterr().out), json.loads(report.read_text())
    facts = explained.frame(FRAME)
    assert facts.items() <= printed.items() and facts.items() <= written.items()
    assert printed["findings"] == written["findings"]


def test_a_frame_that_is_not_there_is_one_line_before_the_solve(
    shot: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "usdface.pipeline.explaining.retarget", lambda *_, **__: pytest.fail("the shot was solved")
    )
    assert main(["fuzzy", "explain", str(shot), "--time", "99"]) == 1
    assert "there is no frame at 99 s" in capsys.readouterr().err
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


@pytest.mark.slow
def test_a_figure_is_written_though_nobody_reads_the_text_to_its_end(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def closed(*_: object) -> None:
        raise BrokenPipeError

    monkeypatch.setattr("usdface.cli.print_fuzzy.print_explanation", closed)
    figure = tmp_path / "why.png"
    assert main(["fuzzy", "explain", str(shot), "--figure", str(figure)]) == 1
    assert figure.read_bytes().startswith(b"\x89PNG")
