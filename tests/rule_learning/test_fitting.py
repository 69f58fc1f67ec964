import json
from pathlib import Path

import numpy as np
import pytest
from labelled_world import SHOWN, labelled_world
from worlds import animation_of

from usdface.cli import main
from usdface.correction.rule_check import fires_at_neutral
from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.io.expressions_file import read_expressions_file
from usdface.io.fuzzy_formats.files import read_fuzzy_file
from usdface.options import FitOptions
from usdface.pipeline import fit_fuzzy, make_shot, process


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("labelled")
    labelled_world(folder)
    return folder


@pytest.fixture(scope="module")
def fitted(folder: Path):
    return fit_fuzzy(
        folder / "rig.usda",
        folder / "fitted.usda",
        bind=folder / "bind.json",
        labels=folder / "labels.csv",
        poses=folder / "poses.json",
    )


@pytest.mark.slow
def test_what_was_labelled_is_heard_in_the_recording_that_was_left_out(fitted):
    result, fit = fitted, fitted.value
    assert fit.system.emotions == tuple(dict.fromkeys(emotion for emotion, _ in SHOWN))
    assert fit.validation.holding == "recording"
    assert fit.validation.right == fit.validation.tested > 0
    assert result.summary["cross_validation"] == {
        "held_out": "recording",
        "correct": 12,
        "tested": 12,
    }
    assert all(len(rule.propositions) <= 3 for rule in fit.system.fuzzy.rules)
    weights = fit.details["fit"]["weights"]
    assert result.summary["rules"] == weights.count(1.0) >= len(fit.system.emotions)
    assert result.summary["fallback_rules"] == len(weights) - weights.count(1.0)
    assert [r for r in fit.system.fuzzy.rules if r.weight < 1] == list(fit.fallback_rules)


@pytest.mark.slow
def test_a_neutral_face_answers_nothing(fitted):
    fit = fitted.value
    assert fit.neutral == 0
    assert fires_at_neutral(fit.system) == []
    at_rest = fit.validation.counts[-1]
    assert at_rest[-1] == at_rest.sum() == 2


@pytest.mark.slow
def test_the_written_system_is_the_one_that_was_fitted(fitted, folder):
    fit = fitted.value
    again, _ = read_fuzzy_file(folder / "fitted.usda")
    faces = np.random.default_rng(0).normal(scale=0.05, size=(50, len(again.features)))
    same = evaluate(again.fuzzy, faces).outputs == evaluate(fit.system.fuzzy, faces).outputs
    assert same.all()
    assert [r.text for r in again.fuzzy.rules] == [r.text for r in fit.system.fuzzy.rules]


@pytest.mark.slow
def test_poses_come_from_the_labelled_frames(fitted, folder):
    """Of anger with open and with closed mouth the pose has the brows, and opens no mouth."""
    poses = read_expressions_file(folder / "poses.json")
    assert set(poses) == {emotion for emotion, _ in SHOWN}
    assert set(poses["anger"].shapes) == {"browDownLeft", "browDownRight"}
    assert set(poses["contempt"].shapes) == set(SHOWN["contempt", ""])
    for pose in poses.values():
        shown = SHOWN.get((pose.name, ""), SHOWN["anger", "closed"])
        true = np.array([shown[shape] for shape in pose.shapes])
        assert pose.weights == pytest.approx(0.92 * true, abs=0.12)


@pytest.mark.slow
def test_a_fitted_system_drives_a_shot(fitted, folder):
    """Contempt, of which no code knows: heard in the take, and its pose raised."""
    make_shot(
        folder / "rig.usda",
        folder / "take_1.usda",
        folder / "shot.usda",
        bind=folder / "bind.json",
        fuzzy=folder / "fitted.usda",
        expressions=folder / "poses.json",
    )
    result = process(folder / "shot.usda")
    assert result.summary["emotion_peaks"]["contempt"] > 0.9
    assert "EXPRESSION_UNKNOWN" not in {f.code for f in result.findings}
    played = animation_of(folder / "shot.usdface.usda")
    held = slice(12 + 4 * 18 + 7, 12 + 4 * 18 + 11)
    assert played.column("mouthSmileLeft")[held].min() > 0.6
    assert played.column("mouthSmileRight")[held].max() < 0.2


@pytest.mark.slow
def test_an_emotion_without_a_pose_is_named_when_the_shot_is_made(fitted, folder, tmp_path):
    result = make_shot(
        folder / "rig.usda",
        folder / "take_1.usda",
        tmp_path / "shot.usda",
        bind=folder / "bind.json",
        fuzzy=folder / "fitted.usda",
    )
    unknown = {f.where for f in result.findings if f.code == "EXPRESSION_UNKNOWN"}
    assert "contempt" in unknown
    assert "joy" not in unknown


@pytest.mark.slow
def test_the_same_takes_give_the_same_bytes(fitted, folder, tmp_path):
    args = folder / "rig.usda", tmp_path / "again.usda"
    fit_fuzzy(*args, bind=folder / "bind.json", labels=folder / "labels.csv")
    assert (tmp_path / "again.usda").read_bytes() == (folder / "fitted.usda").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("space", "paper"),
    [
        ("character", True),
        pytest.param("take", False, marks=pytest.mark.slow),
        pytest.param("character", False, marks=pytest.mark.slow),
        pytest.param("take", True, marks=pytest.mark.slow),
    ],
)
def test_every_way_hears_what_it_was_fitted_on(folder, tmp_path, space, paper):
    fit = fit_fuzzy(
        folder / "rig.usda",
        tmp_path / "fitted.fll",
        options=FitOptions(paper=paper, space=space),
        bind=folder / "bind.json",
        labels=folder / "labels.csv",
    ).value
    assert fit.system.space == space
    assert {f.measure for f in fit.system.features} == {"absolute" if paper else "signed"}
    make_shot(
        folder / "rig.usda",
        folder / "take_0.usda",
        tmp_path / "shot.usda",
        bind=folder / "bind.json",
        fuzzy=tmp_path / "fitted.fll",
    )
    summary = process(tmp_path / "shot.usda").summary
    assert min(summary["emotion_peaks"][emotion] for emotion, _ in SHOWN) > 0.5


def test_the_default_design_needs_no_recording(folder, tmp_path):
    rig, bind = folder / "rig.usda", folder / "bind.json"
    result = fit_fuzzy(rig, tmp_path / "design.usda", bind=bind)
    fit = result.value
    make_shot(rig, folder / "take_0.usda", tmp_path / "shot.usda", bind=bind)
    from_shot, _ = read_fuzzy_file(tmp_path / "shot.usda")
    assert from_shot == read_fuzzy_file(tmp_path / "design.usda")[0]
    assert fit.validation is None
    pairs = len(fit.expressions) * (len(fit.expressions) - 1) // 2
    assert len(fit.separations) == pairs and all(pair.separated for pair in fit.separations)
    assert result.summary["neutral_output_max"] == 0
    result = fit_fuzzy(tmp_path / "shot.usda", tmp_path / "again.usda")
    again = result.value
    assert [r.text for r in again.system.fuzzy.rules] == [r.text for r in fit.system.fuzzy.rules]
    assert result.written == (tmp_path / "again.usda",)


def test_the_papers_way_works_on_the_rigs_poses(folder, tmp_path):
    options = FitOptions(paper=True)
    rig, bind = folder / "rig.usda", folder / "bind.json"
    fit = fit_fuzzy(rig, tmp_path / "paper.fis", options=options, bind=bind).value
    assert {t.name for v in fit.system.fuzzy.inputs for t in v.terms} == {"low", "medium", "high"}
    assert len(fit.system.fuzzy.rules) == len(fit.expressions)
    with pytest.raises(InputError, match='labels for space "take"'):
        fit_fuzzy(rig, tmp_path / "x.fis", options=FitOptions(space="take"), bind=bind)


@pytest.mark.slow
def test_a_marker_that_a_take_lacks_is_not_relied_on(folder, tmp_path):
    """Renamed in the binding, it is missing from all takes: the rest must do."""
    bind = json.loads((folder / "bind.json").read_text())
    bind["markers"]["elsewhere"] = bind["markers"].pop("brow")
    (tmp_path / "bind.json").write_text(json.dumps(bind))
    fit = fit_fuzzy(
        folder / "rig.usda",
        tmp_path / "fitted.usda",
        options=FitOptions(space="take"),
        bind=tmp_path / "bind.json",
        labels=folder / "labels.csv",
    ).value
    assert "elsewhere" not in {f.role for f in fit.system.features}
    assert fit.validation.right == fit.validation.tested > 0


def labels(folder: Path, text: str) -> Path:
    path = folder / "labels_wrong.csv"
    path.write_text("take,start_frame,end_frame,emotion\n" + text)
    return path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("take_0.usda,90,5000,joy\n", "joy is labelled from 90 to 5000 .frame., but the take has"),
        ("take_9.usda,0,3,joy\n", "take_9.usda"),
        ("take_0.usda,0,3,neutral\n", "the labels name no emotion"),
    ],
)
def test_labels_that_do_not_fit_are_refused(folder, tmp_path, text, message):
    output = tmp_path / "fitted.usda"
    with pytest.raises(InputError, match=message):
        fit_fuzzy(
            folder / "rig.usda",
            output,
            bind=folder / "bind.json",
            labels=labels(folder, text),
        )
    assert not output.exists()


def test_a_system_for_other_markers_is_refused(folder, tmp_path):
    """A shot must not be written with a system that can never run on it."""
    (tmp_path / "foreign.fll").write_text(
        "Engine: foreign\nInputVariable: ear_y\n  enabled: true\n  range: 0 1\n"
        "  lock-range: false\n  term: up Ramp 0 1\nOutputVariable: joy\n  enabled: true\n"
        "  range: 0 1\n  lock-range: false\n  aggregation: none\n"
        "  defuzzifier: WeightedAverage TakagiSugeno\n  default: 0\n  lock-previous: false\n"
        "  term: all Constant 1\nRuleBlock: mamdani\n  enabled: true\n  conjunction: Minimum\n"
        "  disjunction: Maximum\n  implication: none\n  activation: General\n"
        "  rule: if ear_y is up then joy is all\n"
    )
    with pytest.raises(InputError, match="marker role 'ear', which no bound marker has"):
        make_shot(
            folder / "rig.usda",
            folder / "take_0.usda",
            tmp_path / "shot.usda",
            bind=folder / "bind.json",
            fuzzy=tmp_path / "foreign.fll",
        )
    assert not (tmp_path / "shot.usda").exists()


@pytest.mark.slow
def test_the_command_shows_rules_and_confusion(folder, tmp_path, capsys):
    common = ["--rig", str(folder / "rig.usda"), "--bind", str(folder / "bind.json")]
    common += ["--labels", str(folder / "labels.csv")]
    options = ["-o", str(tmp_path / "a.usda"), "--figure", str(tmp_path / "a.png")]
    assert main(["fuzzy", "fit", *common, *options]) == 0
    printed = capsys.readouterr().out
    assert "THEN contempt IS 1" in printed
    assert "each recording held out" in printed
    assert "surprise / contempt" in printed
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    options = ["-o", str(tmp_path / "b.usda"), "--format", "json"]
    assert main(["fuzzy", "fit", *common, *options]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["fit"]["validation"]["confusion"]["joy"]["joy"] == 2
    assert len(facts["fit"]["separations"]) == 6
    options = ["-o", str(tmp_path / "c.usda"), "--figure", str(tmp_path / "c.txt")]
    assert main(["fuzzy", "fit", *common, *options]) == 1
    assert not (tmp_path / "c.usda").exists()
    assert main(["fuzzy", "fit", "--rig", "rig.usda", "-o", "x.usda"]) == 1
    assert "--rig and --bind belong together" in capsys.readouterr().err
