"""The main job on the example: what README's first command does, judged by what was performed."""

import json
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documented_findings import undocumented_keys
from pxr import Usd
from worlds import animation_of

import usdface
from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.expression_system import ExpressionSystem
from usdface.io.bind_file import bind_json
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.takes import WeightsTake

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # the examples are no part of the installed package

from examples import make_example, performance  # noqa: E402
from examples.expressions import EMOTIONS  # noqa: E402

FILES = ("head.usdc", "take.usdc", "shot.usda")
NEUTRAL = slice(performance.NEUTRAL[0], performance.NEUTRAL[1] + 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the example with the result beside it."""
    folder = tmp_path_factory.mktemp("example")
    for name in FILES:
        shutil.copy(ROOT / "examples" / name, folder)
    command = ["process", "shot.usda", "--gltf", "face.glb", "--report", "report.json"]
    assert main([str(folder / word) if "." in word else word for word in command]) == 0
    return folder


@pytest.fixture(scope="module")
def shown() -> dict[str, int]:
    """The frame in which the performer shows most of each emotion."""
    return dict(zip(EMOTIONS, performance.perform().amounts.argmax(axis=0).tolist(), strict=True))


@pytest.fixture(scope="module")
def emotions(folder: Path) -> dict[str, FloatArray]:
    """The emotion curves that the express layer carries."""
    stage = Usd.Stage.Open(str(folder / "shot.usdface.usda"))
    system = stage.GetPrimAtPath("/Shot/Fuzzy")
    curves = {name: system.GetAttribute(f"usdface:emotion:{name}") for name in EMOTIONS}
    return {n: np.array([a.Get(t) for t in a.GetTimeSamples()]) for n, a in curves.items()}


def printed(system: ExpressionSystem | None) -> tuple[str, FloatArray]:
    """A system as text without its numbers, and its numbers."""
    number = r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
    text = repr(system)
    return re.sub(number, "#", text), np.array(re.findall(number, text), dtype=np.float64)


def result(folder: Path, muted: str = "") -> WeightsTake:
    return animation_of(folder / "shot.usdface.usda", muted=muted)


@pytest.mark.slow
def test_the_page_of_reports_has_its_keys(folder: Path) -> None:
    made = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert len(made["closings"]) == 6
    assert undocumented_keys(made) == set()


@pytest.mark.slow
def test_each_emotion_is_heard_where_it_is_shown(
    emotions: dict[str, FloatArray], shown: dict[str, int]
) -> None:
    for emotion, frame in shown.items():
        strengths = {name: float(curve[frame]) for name, curve in emotions.items()}
        assert max(strengths, key=strengths.__getitem__) == emotion
        assert strengths[emotion] > 0.3


@pytest.mark.slow
def test_the_peaks_show_the_units_of_their_emotions(
    folder: Path, shown: dict[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    """At the markers and on the face, where each emotion peaks; corrected farther than solved."""
    path = folder / "shot.usdface.usda"
    amounts = dict(zip(EMOTIONS, performance.perform().amounts.T, strict=True))
    verdicts = usdface.check(path, facs=True).details["facs"][0]
    assert verdicts["counts"] == {"done": 51, "unnamed": 1}
    assert not any(peak["lost"] for peak in verdicts["peaks"])
    for emotion, frame in shown.items():
        near = [p for p in verdicts["peaks"] if abs(p["frame"] - frame) < 60]
        (peak,) = (p for p in near if p["emotion"] == emotion)
        amount = amounts[emotion]
        assert amount[peak["frame"]] > 0.9 * amount[frame], emotion
        assert all(peak[at]["criteria"] for at in ("markers", "solved", "corrected")), emotion
        solved, corrected = (
            sum(unit["moved_mm"] for unit in peak[at]["units"]) for at in ("solved", "corrected")
        )
        assert corrected > 1.1 * solved, emotion
    assert main(["check", str(path), "--facs"]) == 0
    assert "peaks of the take" in capsys.readouterr().out


@pytest.mark.slow
def test_a_neutral_face_stays_neutral(folder: Path, emotions: dict[str, FloatArray]) -> None:
    for curve in emotions.values():
        # The features are smoothed: the last frame sees the smile that begins after it.
        assert not curve[NEUTRAL][:-1].any() and curve[NEUTRAL.stop - 1] < 0.002
    corrected, solved = result(folder), result(folder, muted="express.usdc")
    # The first expression begins at once, and its correction within 0.2 s before.
    still, coming = slice(NEUTRAL.start, NEUTRAL.stop - 12), slice(NEUTRAL.stop - 12, NEUTRAL.stop)
    np.testing.assert_array_equal(corrected.weights[still], solved.weights[still])
    np.testing.assert_allclose(corrected.weights[coming], solved.weights[coming], atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_character_of_another_size_performs_alike(
    folder: Path, tmp_path: Path, size: float
) -> None:
    """Lengths that were found on people count by the size of the face: not one weight changes."""
    rig, _ = usdface.read_rig(folder / "head.usdc")
    resized = replace(rig, meshes=tuple(mesh.scaled(size) for mesh in rig.meshes))
    take, _ = usdface.read_take(folder / "take.usdc")
    bind, _ = usdface.read_bind(ROOT / "examples" / "bind.json")
    human, other = (
        usdface.retarget(usdface.assemble_shot(each, take, setup=bind)[0])
        for each in (rig, resized)
    )
    np.testing.assert_allclose(other.solved.weights, human.solved.weights, atol=1e-6)
    assert human.corrected is not None and other.corrected is not None
    np.testing.assert_allclose(other.corrected, human.corrected, atol=1e-6)
    np.testing.assert_allclose(other.weights.weights, human.weights.weights, atol=1e-6)
    assert [f.code for f in other.findings] == [f.code for f in human.findings]


@pytest.mark.slow
def test_the_retarget_gives_what_was_performed(folder: Path) -> None:
    """On another face, with noise, occlusions and a moving head."""
    solved, truth = result(folder, muted="express.usdc"), performance.perform().weights
    error = solved.reordered(truth.names).weights - truth.weights
    assert np.sqrt((error**2).mean()) < 0.05


@pytest.mark.slow
def test_the_corrector_brings_a_weak_performance_to_its_expression(
    folder: Path, shown: dict[str, int]
) -> None:
    corrected = result(folder, muted="closure.usdc")
    solved = result(folder, muted="express.usdc")
    assert (corrected.weights >= solved.weights).all() and corrected.weights.max() <= 1
    missing = np.array(
        [
            [
                np.mean(
                    [full - take.column(name)[frame] for name, full in EMOTIONS[emotion].items()]
                )
                for take in (solved, corrected)
            ]
            for emotion, frame in shown.items()
        ]
    )
    assert (missing[:, 1] < missing[:, 0]).all()
    assert missing[:, 1].mean() < 0.5 * missing[:, 0].mean()


@pytest.mark.slow
def test_a_gain_is_how_much_of_the_poses_weights_are_raised_to(folder: Path) -> None:
    """docs/fuzzy.md: 0.8 halves the correction, 0.5 leaves a tenth of it."""
    staged, _ = read_shot(open_stage(folder / "shot.usda"), "shot")
    solved, raised = usdface.retarget(staged.shot), {}
    for gain in (0.5, 0.8, 1.0):
        given = usdface.ProcessOptions(closure=False, gains=dict.fromkeys(EMOTIONS, gain))
        result = usdface.correct(solved, options=given)
        raised[gain] = np.abs(result.corrected - result.solved.weights).sum()
    assert raised[0.8] / raised[1.0] == pytest.approx(0.5, abs=0.1)
    assert raised[0.5] / raised[1.0] == pytest.approx(0.1, abs=0.05)


@pytest.mark.slow
def test_every_blink_that_was_performed_closes_both_eyes(folder: Path) -> None:
    truth = performance.perform().weights.column("eyeBlinkLeft")
    peaks = np.flatnonzero((truth[1:-1] > 0.9) & (truth[1:-1] >= truth[:-2])) + 1
    peaks = peaks[np.diff(peaks, prepend=-100) > 10]
    stage = Usd.Stage.Open(str(folder / "shot.usdface.usda"))
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    final, corrected = result(folder), result(folder, muted="closure.usdc")
    for side in ("Left", "Right"):
        attribute = retarget.GetAttribute(f"usdface:closure:{side.lower()}Eye")
        curve = np.array([attribute.Get(code) for code in attribute.GetTimeSamples()])
        starts = np.flatnonzero(np.diff((curve == 1).astype(int)) == 1) + 1
        assert len(starts) == len(peaks) and np.abs(starts - peaks).max() <= 4
        blink = final.column(f"eyeBlink{side}")
        assert blink[starts].min() > 0.8
        # Elsewhere only lids that cross are parted.
        other = curve == 0
        assert (blink[other] <= corrected.column(f"eyeBlink{side}")[other]).all()


@pytest.mark.slow
def test_without_the_closure_layer_the_correction_plays(folder: Path, tmp_path: Path) -> None:
    for name in FILES:
        shutil.copy(folder / name, tmp_path)
    assert main(["process", str(tmp_path / "shot.usda"), "--no-closure"]) == 0
    assert not (tmp_path / "shot.usdface" / "closure.usdc").exists()
    np.testing.assert_array_equal(
        result(tmp_path).weights, result(folder, muted="closure.usdc").weights
    )


@pytest.mark.slow
def test_the_glb_is_valid(folder: Path, validate_gltf: Callable[[Path], Any]) -> None:
    issues = validate_gltf(folder / "face.glb")["issues"]
    assert issues["numErrors"] == issues["numWarnings"] == 0


@pytest.mark.slow
def test_the_commands_make_the_committed_shot(tmp_path: Path) -> None:
    for name in ("head.usdc", "performance.trc", "bind.json"):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    make_example.make_stages(tmp_path)
    paths = [place / "shot.usda" for place in (ROOT / "examples", tmp_path)]
    stages = [open_stage(path) for path in paths]
    staged = [read_shot(stage, "shot")[0] for stage in stages]
    assert staged[0].prims == staged[1].prims
    ours, made = (each.shot for each in staged)
    assert bind_json(ours.setup) == bind_json(made.setup)
    # Another processor rounds otherwise: everything but the last digits of the numbers is the same.
    (text, numbers), (again, others) = (printed(each.system) for each in (ours, made))
    assert text == again
    np.testing.assert_allclose(others, numbers, rtol=1e-9)
    for a, b in zip(ours.expressions, made.expressions, strict=True):
        assert (a.name, a.shapes, a.gain) == (b.name, b.shapes, b.gain)
        np.testing.assert_array_equal(a.weights, b.weights)
    for name in ("take.usdc", "head.usdc"):
        assert (tmp_path / name).read_bytes() == (ROOT / "examples" / name).read_bytes()
