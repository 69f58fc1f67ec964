"""The extension for Blender, installed from its package into Blender 4.5 and 5.0."""

import json
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

import usdface
from usdface.cli import main
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.shot.shot import Shot

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
PACKAGE = ROOT / ".venv-blender" / "usdface.zip"
PYTHONS = {
    "4.5": ROOT / ".venv-blender" / "bin" / "python",
    "5.0": ROOT / ".venv-blender5" / "bin" / "python",
}
SECONDS = 600
INSTALL = (
    "import bpy; bpy.ops.extensions.package_install_files("
    "filepath={!r}, repo='user_default', enable_on_install=False)"
)

Run = Callable[..., dict[str, Any]]


@pytest.fixture(scope="module", params=list(PYTHONS))
def blender_with(request, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run a scenario of blender_plugin.py in a Blender that the extension was installed in."""
    python = PYTHONS[request.param]
    if not python.exists() or not PACKAGE.exists():
        pytest.skip(f"Blender {request.param} or the extension is not there; .ci/run makes them")
    home = tmp_path_factory.mktemp("blender")
    environment = {
        "BLENDER_USER_RESOURCES": str(home),
        "HOME": str(home),
        "PATH": "/usr/bin:/bin",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    command = [python, "-c", INSTALL.format(str(PACKAGE))]
    subprocess.run(command, env=environment, check=True, timeout=SECONDS, capture_output=True)
    answers: dict[str, dict[str, Any]] = {}

    def run(scenario: str, folder: Path | None = None) -> dict[str, Any]:
        if scenario not in answers or folder is not None:
            place = folder or tmp_path_factory.mktemp(scenario)
            with tempfile.TemporaryDirectory() as hidden:
                out = Path(hidden) / "answer.json"
                command = [python, HERE / "blender_plugin.py", scenario, place, out]
                done = subprocess.run(
                    command, env=environment, capture_output=True, text=True, timeout=SECONDS
                )
                assert out.exists(), done.stdout[-2000:] + done.stderr[-3000:]
                answers[scenario] = json.loads(out.read_text()) | {"folder": str(place)}
            assert done.returncode == 0, done.stderr[-2000:]
        return answers[scenario]

    return run


def test_panel_plays_the_weights_of_the_layers_at_every_frame(blender_with: Run) -> None:
    answer = blender_with("panel")
    for share in ("at 1.0", "at 0.0", "at 0.5"):
        error, curves, motion = answer[share]
        assert error < 1e-5 and curves >= 80 and motion > 0.9
    assert answer["clock"] == [60.0, 1, 720]
    assert answer["verdict"] == "good"


def test_an_action_of_the_users_is_kept_on_a_muted_track(blender_with: Run) -> None:
    assert blender_with("panel")["tracks"] == {
        "before usdface": [True, 1],
        "usdface raw": [False, 1],
        "usdface expressive": [False, 1],
    }


def test_worst_frames_are_the_largest_residuals_and_apart(blender_with: Run) -> None:
    answer = blender_with("panel")
    residual, worst = np.array(answer["residual"]), answer["worst"]
    assert worst[0][1] == pytest.approx(residual.max(), rel=1e-6)
    for frame, value in worst:
        assert value == pytest.approx(residual[frame - 1], rel=1e-6)
    frames = sorted(frame for frame, _ in worst)
    assert min(np.diff(frames)) >= 15 and answer["went to"] == worst[0][0]


def test_rules_of_a_frame_are_those_that_fire(blender_with: Run) -> None:
    answer = blender_with("panel")
    strengths = [strength for strength, _ in answer["rules"]]
    assert strengths == [s for s in answer["firing"] if s >= 0.05][:4]
    assert answer["rules"][0][1].endswith("THEN joy IS 1")


def test_a_gain_of_zero_takes_an_emotion_away_and_no_action_is_left_over(blender_with: Run) -> None:
    answer = blender_with("panel")
    loud, quiet = answer["joy"]
    assert quiet < loud - 0.5
    assert answer["actions"][0] == answer["actions"][1]


def test_undo_takes_the_result_back(blender_with: Run) -> None:
    assert blender_with("panel")["undone"] == [1, 24, ""]


def test_all_panels_are_drawn(blender_with: Run) -> None:
    drawn = blender_with("panel")["drawn"]
    for part in (
        "character",
        "take_kind",
        "usdface.process",
        "usdface.propose",
        "usdface.drag_marker",
        "usdface.mirror_markers",
        "usdface.neutral_here",
        "influence",
        "usdface.worst_frame",
        "usdface.choose_gltf",
        "export_process",
    ):
        assert part in drawn, part


def test_panels_are_drawn_for_the_pictures_of_the_documentation(blender_with: Run) -> None:
    pictured = blender_with("panel")["pictured"]
    titles = ["Face", "Markers on the face", "Result", "USD export"]
    assert [panel["title"] for panel in pictured] == titles
    assert all(panel["layout"]["items"] for panel in pictured)


def test_our_gltf_and_blenders_are_equal(blender_with: Run) -> None:
    folder = Path(blender_with("panel")["folder"])
    (_, (ours,), _), (_, theirs, _) = (
        read_gltf(folder / f"{name}.glb", None) for name in ("ours", "theirs")
    )
    (expressive,) = (c for c in theirs if c.name == "usdface expressive")
    mine, other = ours.weights, expressive.weights
    assert mine is not None and other is not None
    assert mine.weights.shape[0] == other.weights.shape[0] == 720
    shared = [name for name in mine.names if name in other.names]
    assert len(shared) >= 51
    columns = [[take.names.index(name) for name in shared] for take in (mine, other)]
    difference = mine.weights[:, columns[0]] - other.weights[:, columns[1]]
    assert np.abs(difference).max() < 1e-5
    np.testing.assert_allclose(np.diff(mine.times), np.diff(other.times), atol=1e-5)


def shot_at(path: Path) -> Shot:
    staged, _ = read_shot(open_shot(path), str(path))
    return staged.shot


def test_an_exported_shot_is_processed_as_the_commands_process_its_parts(
    blender_with: Run, tmp_path: Path
) -> None:
    answer = blender_with("hook")
    folder, take = Path(answer["folder"]), tmp_path / "take.usdc"
    assert [severity for severity, *_ in answer["messages"]] == ["info"]
    words = ("--units", "m", "--up-axis", "Y", "--rate", "60")
    rig, bind = folder / "character.usda", folder / "bind.json"
    for command in (
        ["take", answer["csv"], "-o", take, *words],
        ["shot", "--rig", rig, "--take", take, "--bind", bind, "-o", tmp_path / "shot.usda"],
        ["process", tmp_path / "shot.usda"],
    ):
        assert main([str(word) for word in command]) == 0
    hooked, _ = usdface.read_result(folder / "shot.usdface.usda")
    assert hooked.start_code == 1.0  # the scene's frames, as Blender exports them
    commanded, _ = usdface.read_result(tmp_path / "shot.usdface.usda")
    one, other = hooked.corrected, commanded.corrected
    columns = [one.names.index(name) for name in other.names]
    assert len(columns) >= 51
    np.testing.assert_allclose(one.weights[:, columns], other.weights, rtol=0, atol=1e-6)
    stage = Usd.Stage.Open(str(folder / "shot.usda"))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 60.0


def test_set_up_and_take_survive_the_way_through_blender(
    blender_with: Run, example: Path, tmp_path: Path
) -> None:
    shutil.copytree(example, tmp_path / "in")
    answer = blender_with("trip", tmp_path)
    before = shot_at(tmp_path / "in" / "shot.usda")
    for name in ("shot.usda", "shot.usdface.usda"):
        named = answer[name]
        assert named["fps"] == 60 and named["range"] == [0, 719] and not named["messages"]
        assert "Take" not in named["objects"] and "Expressions" not in named["objects"]
        after = shot_at(tmp_path / f"out_{name}")
        same_setup(before, after)
    assert answer["shot.usdface.usda"]["tracks"] == ["usdface raw", "usdface expressive"]
    same_setup(before, shot_at(Path(answer["processed"]).with_name("shot.usdc")))


def same_setup(before: Shot, after: Shot) -> None:
    """Compare all of two shots but the rig, whose vertices Blender rounds to float32."""
    assert after.take.names == before.take.names and after.take.rate == before.take.rate
    np.testing.assert_allclose(after.take.positions, before.take.positions, rtol=0, atol=1e-9)
    np.testing.assert_allclose(after.take.times, before.take.times, rtol=0, atol=1e-9)
    one, other = before.setup, after.setup
    # Blender puts the mesh at another path.
    for own, found in ((one.binding, other.binding), (one.unsure, other.unsure)):
        assert found.markers == own.markers
        np.testing.assert_array_equal(found.points, own.points)
    for field in type(one).__dataclass_fields__:
        if field not in ("binding", "unsure"):
            assert repr(getattr(other, field)) == repr(getattr(one, field)), field
    assert repr(after.expressions) == repr(before.expressions)
    assert repr(after.layout) == repr(before.layout)
    assert before.system is not None and after.system is not None
    rules = [[r.text, r.weight, r.enabled] for r in before.system.fuzzy.rules]
    assert [[r.text, r.weight, r.enabled] for r in after.system.fuzzy.rules] == rules
    assert repr(after.system.fuzzy.inputs) == repr(before.system.fuzzy.inputs)
    (mesh,) = (m for m in before.rig.meshes if m.path == one.binding.mesh)
    (twin,) = (m for m in after.rig.meshes if m.path == other.binding.mesh)
    np.testing.assert_allclose(twin.points, mesh.points, rtol=0, atol=1e-7)
    assert twin.shape_names == mesh.shape_names


def test_markers_are_proposed_snapped_and_mirrored(blender_with: Run) -> None:
    answer = blender_with("markers")
    assert answer["on face"] < 1e-7 and answer["snap"] == ["FACE"]
    assert np.abs(answer["mirrored"]).max() < 1e-6  # the example's head is symmetric
    assert answer["nose"] == "lip_corner_left" and answer["neutral"] == [11, 19]
    assert len(answer["proposed"]) == answer["given"] == 42
    assert np.median(answer["proposed"]) < 1e-6  # m: most on the very vertex


def test_register_and_unregister_leave_nothing(blender_with: Run) -> None:
    answer = blender_with("lifecycle")
    assert answer["before"] == answer["after"]
    for during in answer["during"]:
        assert during["scene"] and during["hooks"] == ["USDFACE_UH_shot"]
        assert "process" in during["operators"]


def test_a_hook_that_fails_leaves_file_and_scene_in_order(blender_with: Run) -> None:
    answer = blender_with("failing")
    for case, part in {
        "crash": "a mistake in the hook",
        "no take": "no such file",
        "no process": "was not processed",
        "usdz": "takes no layers",
    }.items():
        ((severity, text, _),), fine = answer[case]
        assert severity == "error" and part in text and fine, case
    assert answer["objects"]


def test_blender_goes_on_while_the_worker_works(blender_with: Run) -> None:
    looks, _, steps, grows, error = blender_with("worker")["ran"]
    assert not error and grows and looks > 20
    assert {"shot: bind", "process: solve", "process: write"} <= set(steps)


def test_a_worker_that_is_killed_or_cancelled_leaves_the_scene(blender_with: Run) -> None:
    answer = blender_with("worker")
    assert "ended from outside (signal 9)" in answer["killed"]
    assert answer["cancelled"] == ["cancelled", False, False]
    assert answer["actions"] == 0 and "signal 9" in answer["operator"]
    actions, ((severity, text, _),), running = answer["after"]
    assert (actions, severity, running) == (0, "error", False) and "signal 9" in text
    assert answer["again"] == ""


def test_bad_input_is_a_message(blender_with: Run) -> None:
    answer = blender_with("bad")
    for case, part in {
        "empty scene": "no mesh of the scene has shape keys",
        "nothing selected": "select a mesh with shape keys",
        "armature without shape keys": "Rig has no shape keys",
        "selected without shape keys": "Rig has no shape keys",
        "no marker selected": "select one of the markers",
        "no result": "Process first",
        "result that is gone": "gone.usda",
        "no take": "there is no take",
        "broken take": "is not a C3D file",
        "no empties": "choose the collection",
        "empties without animation": "have no animation",
        "folder that cannot be written": "cannot write into",
        "marker far off": "is away from the face",
        "marker twice": "two empties are the marker chin",
        "two faces": "2 characters with shape keys",
        "old Blender": "usdface needs Blender 99.0 or later",
    }.items():
        assert part in answer[case], case
    for case, part in {
        "export of empties without animation": "have no animation",
        "export of two faces": "choose one under Character",
        "export without shape keys": "is not in the export with its shape keys",
    }.items():
        messages, exported = answer[case]
        assert exported and part in messages[-1][1], case
    assert answer["one of two faces"] == answer["modifier"] == "" and answer["alive"] == "Scene"


def test_a_hidden_character_is_processed_unless_a_collection_hides_it(blender_with: Run) -> None:
    answer = blender_with("hidden")
    assert answer["flags"] == "" and answer["kept"] == [True, True, True]
    assert "exports no shape keys of head" in answer["collection"]


def test_schemas_that_come_too_late_do_no_harm(blender_with: Run) -> None:
    answer = blender_with("late")
    assert "registry was built before" in answer["schemas"]
    assert not answer["messages"] and not answer["refused"]
    assert answer["result"].endswith("shot.usdface.usda")


def test_an_optical_take_on_ict_plays_in_blender(
    blender_with: Run, ict_rig: Path, shared_data: Path, tmp_path: Path
) -> None:
    shutil.copy(ict_rig, tmp_path / "rig.usdc")
    shutil.copy(ROOT / "tests" / "data" / "animface_ict_bind.json", tmp_path / "bind.json")
    source = shared_data / "animface" / "Jaw.c3d"
    assert main(["take", str(source), "-o", str(tmp_path / "take.usdc")]) == 0
    answer = blender_with("real", tmp_path)
    assert not answer["refused"]
    error, curves, motion = answer["difference"]
    assert error < 1e-5 and curves >= 50 and motion > 0.3
