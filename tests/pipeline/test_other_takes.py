"""Takes of weights, of an image, from other files, and with markers that are hidden."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import EXACT, Done, codes_in, process, report, run, shoot, solved
from pxr import Usd, UsdSkel
from scipy.spatial.transform import Rotation
from worlds import animation_of, camera_pixels, filmed, make_world, write_live_link

from usdface.cli import main
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.io.usd.take_write import write_take
from usdface.takes import MarkerTake, WeightsTake


def test_weights_recorded_by_a_phone_play_by_name(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    (folder / "bind.json").unlink()
    write_live_link(world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    shot = shoot(folder)
    assert "EXPRESS_SKIPPED" in codes_in(report(tmp_path, "process", shot))
    unused = "the gains of emotions change nothing"
    assert main(["process", str(shot)]) == 0
    assert unused not in capfd.readouterr().out
    assert main(["process", str(shot), "--gains", "joy=0.5"]) == 0
    assert unused in capfd.readouterr().out
    assert main(["fuzzy", "explain", str(shot)]) == 1
    error = capfd.readouterr().err
    assert "`usdface shot` designs one where markers are bound" in error
    assert main(["fuzzy", "fit", "--shot", str(shot), "-o", str(tmp_path / "system.usda")]) == 1
    assert "shot.usda: no marker is bound, so there are no features for rules" in (
        capfd.readouterr().err
    )
    played = animation_of(folder / "shot.usdface.usda").reordered(world.rig.shape_names)
    np.testing.assert_allclose(played.weights, world.weights, atol=1e-6)


def test_a_calibration_of_a_performer_is_named_as_unused_by_a_phone(tmp_path: Path) -> None:
    """It is of markers; without a word its gains would seem applied."""
    world = make_world()
    folder = world.write(tmp_path)
    (folder / "bind.json").unlink()
    write_live_link(world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    (folder / "anna.json").write_text('{"shapes": {"jawOpen": {"gain": 0.8}}}')
    arguments = [*shot_files(folder), "--calibration", folder / "anna.json"]
    assert "CALIBRATION_UNUSED" in codes_in(report(tmp_path, "shot", *arguments))


def test_a_phone_drives_a_rig_with_other_names(tmp_path: Path) -> None:
    """By action units; the file of the binding shows how, and an edit of it counts."""
    world = make_world()
    mesh = world.rig.meshes[0]
    names = {"jawOpen": "mouth-open", "browInnerUp": "AU01"}
    shapes = tuple(replace(s, name=names.get(s.name, f"own{i}")) for i, s in enumerate(mesh.shapes))
    foreign = replace(world, rig=replace(world.rig, meshes=(replace(mesh, shapes=shapes),)))
    folder = foreign.write(tmp_path)
    (folder / "bind.json").unlink()
    write_live_link(world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    files = ["--rig", folder / "rig.usda", "--take", folder / "take.usda", "-o", folder / "s.usda"]
    made = report(tmp_path, "shot", *files, "--write-bind", folder / "curves.json")
    assert "CURVES_BY_UNIT" in codes_in(made)
    run("process", folder / "s.usda")
    played = animation_of(folder / "s.usdface.usda").reordered(tuple(s.name for s in shapes))
    own = {name: world.weights[:, i] for i, name in enumerate(world.rig.shape_names)}
    np.testing.assert_allclose(played.column("mouth-open"), 0.8 * own["jawOpen"], atol=1e-6)
    np.testing.assert_allclose(played.column("AU01"), own["browInnerUp"], atol=1e-6)
    # The tutorial's way: look at the file, change it, make the shot again.
    bind = json.loads((folder / "curves.json").read_text())
    assert bind["curves"] == {
        "jawOpen": {"mouth-open": 0.8},
        "browInnerUp": {"AU01": 1.0},
    }
    bind["curves"]["jawOpen"] = {"mouth-open": 0.5, "AU01": 0.25}
    (folder / "curves.json").write_text(json.dumps(bind))
    made = report(tmp_path, "shot", *files, "--bind", folder / "curves.json")
    assert codes_in(made).isdisjoint({"CURVES_BY_UNIT", "NEUTRAL_ASSUMED"})
    run("process", folder / "s.usda")
    played = animation_of(folder / "s.usdface.usda")
    expected = (own["browInnerUp"] + 0.25 * own["jawOpen"]).clip(0.0, 1.0)
    np.testing.assert_allclose(played.column("mouth-open"), 0.5 * own["jawOpen"], atol=1e-6)
    np.testing.assert_allclose(played.column("AU01"), expected, atol=1e-6)


def test_a_file_of_curves_alone_may_name_a_few(done: Done, tmp_path: Path) -> None:
    """The others go by name or unit; curves that the take lacks are named with the file."""
    folder = done.world.write(tmp_path)
    write_live_link(done.world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    curves = {"BrowInnerUp": {"jawOpen": 0.5}, "jawOpn": {}, "smile": {}}
    (folder / "bind.json").write_text(json.dumps({"curves": curves}))
    made = report(tmp_path, "shot", *shot_files(folder), "--bind", folder / "bind.json")
    (found,) = (f for f in made["findings"] if f["code"] == "CURVE_UNKNOWN")
    assert found["values"]["curves"] == ["jawOpn", "smile"] and "bind.json" in found["where"]
    assert "NEUTRAL_ASSUMED" not in codes_in(made)
    run("process", folder / "shot.usda")
    played = animation_of(folder / "shot.usdface.usda").reordered(done.world.rig.shape_names)
    own = dict(zip(done.world.rig.shape_names, done.world.weights.T, strict=True))
    np.testing.assert_allclose(played.column("jawOpen"), 0.5 * own["browInnerUp"], atol=1e-6)
    assert not played.column("browInnerUp").any()
    np.testing.assert_allclose(played.column("browDownLeft"), own["browDownLeft"], atol=1e-6)


def test_neutral_frames_of_a_recorded_head_are_named_and_checked(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    turns = np.outer(np.linspace(0.0, 0.5, len(world.take.times)), [0.0, 1.0, 0.0])
    take = WeightsTake(
        world.rig.shape_names, world.take.times, world.weights, world.take.rate, head=turns
    )
    write_take(take, folder / "take.usda")
    files = shot_files(folder)
    assert "NEUTRAL_ASSUMED" in codes_in(report(tmp_path, "shot", *files))
    made = report(tmp_path, "shot", *files, "--neutral", 20, 30)
    assert "NEUTRAL_ASSUMED" not in codes_in(made)
    shot = read_shot(open_stage(folder / "shot.usda"), "shot.usda")[0].shot
    assert shot.setup.neutral == (20, 30)
    assert main([*map(str, ["shot", *files]), "--neutral", "20", "400"]) == 1
    found = codes_in(report(tmp_path, "shot", *files, "--neutral", "auto"))
    assert "NEUTRAL_FOUND" in found and "NEUTRAL_ASSUMED" not in found
    shot = read_shot(open_stage(folder / "shot.usda"), "shot.usda")[0].shot
    assert shot.setup.neutral_removed


def test_a_wrong_blend_shape_is_refused_with_its_file(
    done: Done, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = done.world.write(tmp_path)
    write_live_link(done.world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    (folder / "curves.json").write_text(json.dumps({"curves": {"jawOpen": {"jawOpn": 1.0}}}))
    arguments = ["shot", *shot_files(folder), "--bind", folder / "curves.json"]
    assert main([str(a) for a in arguments]) == 1
    printed = capsys.readouterr().err
    assert "curves.json: the curve 'jawOpen' is to drive 'jawOpn'" in printed


def test_curves_are_of_no_use_to_markers(done: Done, tmp_path: Path) -> None:
    folder = done.world.write(tmp_path)
    (folder / "bind.json").write_text(json.dumps({"curves": {"jawOpen": {"jawOpen": 1.0}}}))
    arguments = ["shot", *shot_files(folder), "--bind", folder / "bind.json"]
    assert main([str(a) for a in arguments]) == 1


def shot_files(folder: Path) -> list[object]:
    return [
        *("--rig", folder / "rig.usda"),
        *("--take", folder / "take.usda"),
        *("-o", folder / "shot.usda"),
    ]


def test_weights_with_a_binding_are_corrected_like_markers(done: Done, tmp_path: Path) -> None:
    folder = done.world.write(tmp_path)
    write_live_link(done.world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    np.testing.assert_allclose(
        animation_of(process(folder)).weights, animation_of(done.root).weights, atol=1e-4
    )


@pytest.mark.slow
def test_a_trc_take_gives_the_same_weights(done: Done, tmp_path: Path) -> None:
    folder = done.world.write(tmp_path)
    write_trc(done.world.take, folder / "take.trc")
    run("take", folder / "take.trc", "-o", folder / "take.usda")
    np.testing.assert_allclose(solved(process(folder), done.world), done.world.weights, atol=1e-4)


def write_trc(take: MarkerTake, path: Path) -> None:
    """Millimetres, with 6 decimals."""
    count, rate = len(take.names), take.rate
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{rate}\t{rate}\t{len(take.times)}\t{count}\tmm",
        "Frame#\tTime\t" + "\t\t\t".join(take.names),
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, count + 1) for axis in "XYZ"),
    ]
    rows = zip(take.times, 1000 * take.positions.reshape(len(take.times), -1), strict=True)
    for number, (time, row) in enumerate(rows, 1):
        lines.append(f"{number}\t{time:.6f}\t" + "\t".join(f"{x:.6f}" for x in row))
    path.write_text("\n".join(lines) + "\n")


def test_a_flat_take_gives_the_weights_nearly(tmp_path: Path) -> None:
    world = make_world(head_moves=False)
    replace(world, take=camera_pixels(world.take)).write(tmp_path, head="stabilised")
    error = solved(process(tmp_path), world) - world.weights
    assert np.sqrt(np.mean(error**2)) < 0.02


@pytest.mark.slow
def test_a_filmed_head_that_turns_gives_the_weights_nearly(tmp_path: Path) -> None:
    world, still = make_world(), make_world(head_moves=False)
    errors = {}
    for name, shown in (("turns", world), ("rests", still)):
        folder = replace(shown, take=filmed(shown.take)).write(tmp_path / name)
        error = solved(process(folder), world) - world.weights
        errors[name] = np.sqrt(np.mean(error**2))
    assert errors["turns"] < 1.5 * max(errors["rests"], 0.01), errors


@pytest.mark.slow
def test_a_film_may_lose_the_face_for_some_frames(tmp_path: Path) -> None:
    world = make_world()
    film = replace(filmed(world.take), focal_length=1300.0)
    lost = film.positions.copy()
    lost[17:19] = np.nan
    weights = {}
    for name, positions in (("whole", film.positions), ("lost", lost)):
        shown = replace(world, take=replace(film, positions=positions))
        weights[name] = solved(process(shown.write(tmp_path / name)), world)
    seen = np.r_[0:17, 19:40]
    np.testing.assert_allclose(weights["lost"][seen], weights["whole"][seen], atol=0.05)
    line = np.linspace(weights["whole"][16], weights["whole"][19], 4)[1:3]
    assert np.abs(weights["lost"][17:19] - line).max() < 0.15


@pytest.mark.slow
def test_a_filmed_head_turns_the_character_as_markers_in_space_do(
    done: Done, tmp_path: Path
) -> None:
    film = replace(filmed(done.world.take), focal_length=1300.0)
    replace(done.world, take=film).write(tmp_path)
    in_space, from_film = (joint_turns(root) for root in (done.root, process(tmp_path)))
    away = Rotation.from_quat(in_space).inv() * Rotation.from_quat(from_film)
    assert np.degrees(away.magnitude()).max() < 0.3
    assert np.degrees(Rotation.from_quat(in_space).magnitude()).max() > 3.0


def joint_turns(root: Path) -> np.ndarray:
    """The rotations (F, 4) of the joint that carries the head: x, y, z, w."""
    stage = Usd.Stage.Open(str(root))
    animation = next(UsdSkel.Animation(p) for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    turns = animation.GetRotationsAttr()
    first = [turns.Get(code)[0] for code in turns.GetTimeSamples()]
    return np.array([[*turn.GetImaginary(), turn.GetReal()] for turn in first])


def test_markers_that_are_hidden_for_a_while_change_little(tmp_path: Path) -> None:
    world = make_world()
    positions = world.take.positions.copy()
    names = world.take.names
    positions[10:15, names.index("lip_upper")] = np.nan
    positions[20:22, names.index("bridge")] = np.nan
    replace(world, take=replace(world.take, positions=positions)).write(tmp_path)
    shot = shoot(tmp_path)
    assert "MARKER_OCCLUDED" in codes_in(report(tmp_path, "process", shot))
    error = np.abs(solved(tmp_path / "shot.usdface.usda", world) - world.weights)
    assert error.max() < 1e-3


@pytest.mark.slow
def test_a_marker_that_is_never_seen_is_left_out(tmp_path: Path) -> None:
    world = make_world()
    positions = world.take.positions.copy()
    positions[:, world.take.names.index("chin")] = np.nan
    replace(world, take=replace(world.take, positions=positions)).write(tmp_path)
    shot = shoot(tmp_path)
    outcome = report(tmp_path, "process", shot)
    assert {"code": "MARKER_NEVER_SEEN", "where": "chin"}.items() <= next(
        f for f in outcome["findings"] if f["code"] == "MARKER_NEVER_SEEN"
    ).items()
    np.testing.assert_allclose(
        solved(tmp_path / "shot.usdface.usda", world), world.weights, atol=EXACT
    )


def test_frames_without_any_marker_follow_their_neighbours(tmp_path: Path) -> None:
    world = make_world()
    positions = world.take.positions.copy()
    positions[12:14] = np.nan
    replace(world, take=replace(world.take, positions=positions)).write(tmp_path)
    shot = shoot(tmp_path)
    outcome = report(tmp_path, "process", shot)
    reported = next(f for f in outcome["findings"] if f["code"] == "FRAME_UNSOLVED")
    assert reported["values"] == {
        "unsolved_count": 2,
        "frame_count": 40,
        "first_frame": 12,
        "start_s": pytest.approx(world.take.times[12], abs=1e-4),
    }
    weights = solved(tmp_path / "shot.usdface.usda", world)
    line = np.linspace(weights[11], weights[14], 4)[1:3]
    assert np.abs(weights[12:14] - line).max() < 0.15
    seen = np.r_[0:12, 14:40]
    np.testing.assert_allclose(weights[seen], world.weights[seen], atol=1e-3)


@pytest.mark.parametrize("film", [False, True])
def test_a_neutral_that_is_not_named_is_looked_for(tmp_path: Path, film: bool) -> None:
    """The take begins in a blink, and rests at the end."""
    world = make_world()
    backwards = replace(world.take, positions=world.take.positions[::-1])
    take = filmed(backwards) if film else backwards
    folder = replace(world, take=take, weights=world.weights[::-1]).write(tmp_path)
    bind = {k: v for k, v in world.bind.items() if k != "neutral"}
    (folder / "bind.json").write_text(json.dumps(bind))
    files = ("--rig", folder / "rig.usda", "--take", folder / "take.usda")
    outcome = report(
        tmp_path, "shot", *files, "--bind", folder / "bind.json", "-o", folder / "shot.usda"
    )
    assert "NEUTRAL_FOUND" in codes_in(outcome)
    assert "NEUTRAL_ASSUMED" not in codes_in(outcome)
    np.testing.assert_allclose(solved(process(folder), world), world.weights[::-1], atol=0.01)


def test_the_first_frame_of_a_film_of_few_markers_is_assumed_neutral(tmp_path: Path) -> None:
    world = make_world()
    folder = replace(world, take=filmed(world.take)).write(tmp_path)
    few = dict(list(world.bind["markers"].items())[:5])  # type: ignore[attr-defined]
    bind = {"markers": few, "nose_tip": "nose"}
    (folder / "bind.json").write_text(json.dumps(bind))
    files = ("--rig", folder / "rig.usda", "--take", folder / "take.usda")
    outcome = report(
        tmp_path, "shot", *files, "--bind", folder / "bind.json", "-o", folder / "shot.usda"
    )
    assert "NEUTRAL_ASSUMED" in codes_in(outcome)
