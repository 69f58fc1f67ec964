"""The whole way from files to files, on a world whose answer is known."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation
from worlds import (
    World,
    animation_of,
    camera_pixels,
    make_world,
    restaged,
    write_live_link,
)

from usdface.cli import main
from usdface.errors import OutputError
from usdface.io.usd.take import write_take
from usdface.pipeline import apply
from usdface.takes import MarkerTake

# Weights from markers that went through float32 files.
EXACT = 2e-5


def run(*arguments: object) -> None:
    assert main([str(a) for a in arguments]) == 0


def shoot(folder: Path) -> Path:
    """Make the shot of a folder's rig, take and binding."""
    shot = folder / "shot.usda"
    bind = ["--bind", folder / "bind.json"] if (folder / "bind.json").exists() else []
    run("shot", "--rig", folder / "rig.usda", "--take", folder / "take.usda", *bind, "-o", shot)
    return shot


def process(folder: Path, *options: object) -> Path:
    """Make the shot if it is not there and process it; return the result's root."""
    shot = folder / "shot.usda"
    run("process", shot if shot.exists() else shoot(folder), *options)
    return folder / "shot.usdface.usda"


def digests(folder: Path) -> dict[str, str]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def solved(root: Path, world: World) -> np.ndarray:
    """The weights below the express layer, in the order of the world's shapes."""
    return animation_of(root, muted="express.usdc").reordered(world.rig.shape_names).weights


def report(folder: Path, *arguments: object) -> dict[str, object]:
    """What a command reports."""
    run(*arguments, "--report", folder / "report.json")
    return json.loads((folder / "report.json").read_text())


def codes_in(outcome: dict[str, object]) -> set[str]:
    return {finding["code"] for finding in outcome["findings"]}


@dataclass(frozen=True)
class Done:
    """A processed shot that tests only read."""

    world: World
    folder: Path
    root: Path
    before: dict[str, str]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    world = make_world()
    folder = world.write(tmp_path_factory.mktemp("done"))
    shoot(folder)
    before = digests(folder)
    return Done(world, folder, process(folder), before)


# What is written


def test_the_result_plays_what_was_solved(done: Done) -> None:
    np.testing.assert_allclose(solved(done.root, done.world), done.world.weights, atol=EXACT)


def test_inputs_keep_their_bytes_and_only_the_named_files_are_written(done: Done) -> None:
    after = digests(done.folder)
    assert {name: after[name] for name in done.before} == done.before
    assert set(after) - set(done.before) == {
        "shot.usdface.usda",
        "shot.usdface/solve.usdc",
        "shot.usdface/express.usdc",
    }


def test_the_corrector_only_raises_and_muting_it_gives_the_solve(done: Done) -> None:
    raw = animation_of(done.root, muted="express.usdc")
    corrected = animation_of(done.root)
    assert (corrected.weights >= raw.weights).all() and corrected.weights.max() <= 1
    assert (corrected.weights > raw.weights + 0.05).any()
    # The correction comes in within 0.2 s, which is longer than this take is neutral.
    np.testing.assert_allclose(corrected.weights[0], raw.weights[0], atol=0.001)


def test_muting_the_express_layer_gives_bit_for_bit_what_no_express_gives(
    done: Done, tmp_path: Path
) -> None:
    root = process(done.world.write(tmp_path), "--no-express")
    assert not (tmp_path / "shot.usdface" / "express.usdc").exists()
    np.testing.assert_array_equal(
        animation_of(root).weights, animation_of(done.root, muted="express.usdc").weights
    )


def test_weight_arrays_are_complete_and_in_the_order_of_the_animation(done: Done) -> None:
    codes = list(range(len(done.world.take.times)))
    for name in ("solve", "express"):
        layer = Sdf.Layer.FindOrOpen(str(done.folder / "shot.usdface" / f"{name}.usdc"))
        path = "/Shot/Character/Face/Anim.blendShapeWeights"
        assert layer.ListTimeSamplesForPath(path) == codes
        samples = [layer.QueryTimeSample(path, code) for code in codes]
        assert {len(s) for s in samples} == {len(done.world.rig.shape_names)}
    assert animation_of(done.root).names == done.world.rig.shape_names


def test_every_layer_has_its_own_clock_units_and_range(done: Done) -> None:
    for name in ("shot.usdface.usda", "shot.usdface/solve.usdc", "shot.usdface/express.usdc"):
        layer = Sdf.Layer.FindOrOpen(str(done.folder / name))
        expected = {
            "timeCodesPerSecond": 30.0,
            "framesPerSecond": 30.0,
            "startTimeCode": 0.0,
            "endTimeCode": 39.0,
            "metersPerUnit": 1.0,
            "upAxis": "Y",
        }
        authored = set(layer.pseudoRoot.ListInfoKeys())
        assert expected.keys() <= authored, name
        assert {key: layer.pseudoRoot.GetInfo(key) for key in expected} == expected, name


def test_emotions_residual_and_head_pose_are_authored_on_every_frame(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.root))
    retarget, fuzzy = (stage.GetPrimAtPath(f"/Shot/{name}") for name in ("Retarget", "Fuzzy"))
    curves = [a for a in fuzzy.GetAttributes() if a.GetName().startswith("usdface:emotion:")]
    assert {a.GetName().rsplit(":", 1)[1] for a in curves} == {"joy", "sadness", "fear", "surprise"}
    joy = fuzzy.GetAttribute("usdface:emotion:joy")
    assert joy.Get(0) == 0 and max(joy.Get(c) for c in joy.GetTimeSamples()) > 0.5
    written = [retarget.GetAttribute(f"usdface:{n}") for n in ("residual", "featurePoints")]
    written.append(retarget.GetAttribute("usdface:head:transform"))
    assert {len(a.GetTimeSamples()) for a in (*curves, *written)} == {len(done.world.take.times)}
    assert max(written[0].Get(c) for c in written[0].GetTimeSamples()) < 1e-6


def test_the_head_transform_brings_the_character_to_the_markers(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.root))
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    for code in (0, 13, 30):
        local = np.array(retarget.GetAttribute("usdface:featurePoints").Get(code))
        head = np.array(retarget.GetAttribute("usdface:head:transform").Get(code))
        np.testing.assert_allclose(
            local @ head[:3, :3] + head[3, :3], done.world.take.positions[code], atol=1e-6
        )


def test_usd_finds_no_error_in_shot_and_result(
    done: Done, tmp_path: Path, assert_valid_usd: Callable[[Path], None]
) -> None:
    assert_valid_usd(done.folder / "shot.usda")
    assert_valid_usd(done.root)
    world = make_world()
    process(without_animation(world.write(tmp_path)))
    assert_valid_usd(tmp_path / "shot.usdface.usda")


@pytest.fixture(scope="module")
def assert_valid_usd() -> Callable[[Path], None]:
    def check(path: Path) -> None:
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        context = UsdValidation.ValidationContext(validators)
        errors = context.Validate(Usd.Stage.Open(str(path)))
        assert [f"{e.GetName()}: {e.GetMessage()}" for e in errors] == []

    return check


# Again, and again elsewhere


@pytest.mark.parametrize("strip", [False, True])
def test_a_second_run_changes_no_byte(tmp_path: Path, strip: bool) -> None:
    folder = make_world().write(tmp_path)
    if strip:
        without_animation(folder)
    process(folder, "--gltf", folder / "face.glb")
    first = digests(folder)
    process(folder, "--gltf", folder / "face.glb")
    assert digests(folder) == first


def test_bytes_do_not_depend_on_the_hash_seed(tmp_path: Path) -> None:
    folder = without_animation(make_world().write(tmp_path))
    script = (
        "import sys; from usdface.cli import main; f = sys.argv[1]\n"
        "main(['shot', '--rig', f + '/rig.usda', '--take', f + '/take.usda',"
        " '--bind', f + '/bind.json', '-o', f + '/shot.usda'])\n"
        "sys.exit(main(['process', f + '/shot.usda']))\n"
    )
    seen = []
    for seed in ("1", "2"):
        subprocess.run(
            [sys.executable, "-c", script, str(folder)],
            env=os.environ | {"PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
        )
        seen.append(digests(folder))
    assert seen[0] == seen[1]


@pytest.mark.parametrize("strip", [False, True])
def test_in_place_adds_layers_to_the_shot_once(tmp_path: Path, strip: bool) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    if strip:
        without_animation(folder)
    root = process(folder)
    beside = animation_of(root).weights
    shot = folder / "shot.usda"
    process(folder, "--in-place")
    layer = Sdf.Layer.FindOrOpen(str(shot))
    assert list(layer.subLayerPaths) == ["./shot.usdface/express.usdc", "./shot.usdface/solve.usdc"]
    np.testing.assert_array_equal(animation_of(shot).weights, beside)
    first = digests(folder)
    process(folder, "--in-place")
    assert digests(folder) == first
    np.testing.assert_array_equal(animation_of(shot).weights, beside)


def test_in_place_keeps_the_layers_that_the_shot_has(tmp_path: Path) -> None:
    folder = make_world().write(tmp_path)
    shot = shoot(folder)
    Sdf.Layer.CreateNew(str(folder / "late.usda")).Save()
    layer = Sdf.Layer.FindOrOpen(str(shot))
    layer.subLayerPaths.append("./late.usda")
    layer.subLayerOffsets[0] = Sdf.LayerOffset(7, 2)
    layer.Save()
    process(folder, "--in-place")
    layer.Reload()
    assert list(layer.subLayerPaths)[2] == "./late.usda"
    assert layer.subLayerOffsets[2] == Sdf.LayerOffset(7, 2)


def test_in_place_works_again_when_its_layers_were_deleted(tmp_path: Path) -> None:
    folder = make_world().write(tmp_path)
    process(folder, "--in-place")
    first = digests(folder)
    for path in (folder / "shot.usdface").iterdir():
        path.unlink()
    process(folder, "--in-place")
    assert digests(folder) == first


def test_the_result_can_go_elsewhere(done: Done, tmp_path: Path) -> None:
    root = tmp_path / "out" / "take_1.usda"
    run("process", done.folder / "shot.usda", "-o", root)
    assert set(digests(tmp_path)) == {
        "out/take_1.usda",
        "out/take_1.usdface/solve.usdc",
        "out/take_1.usdface/express.usdc",
    }
    np.testing.assert_array_equal(animation_of(root).weights, animation_of(done.root).weights)


def test_an_open_stage_gets_what_process_writes(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    outcome = apply(stage)
    assert outcome.written == () and outcome.summary["frames"] == 40
    written, applied = animation_of(done.root), animation_of(stage)
    np.testing.assert_array_equal(applied.weights, written.weights)
    np.testing.assert_allclose(applied.times, written.times, atol=1e-9)
    both = Usd.Stage.Open(str(done.root)), stage
    for path in ("/Shot/Fuzzy.usdface:emotion:joy", "/Shot/Retarget.usdface:residual"):
        written, applied = (s.GetAttributeAtPath(path) for s in both)
        curves = [[attribute.Get(c) for c in range(40)] for attribute in (written, applied)]
        np.testing.assert_allclose(*curves, atol=1e-6)
    assert digests(done.folder).items() >= done.before.items()


def test_apply_again_changes_nothing(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    apply(stage)
    first = stage.GetSessionLayer().ExportToString()
    apply(stage)
    assert stage.GetSessionLayer().ExportToString() == first


def test_apply_says_when_the_edit_target_cannot_take_it(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    foreign = Sdf.Layer.FindOrOpen(str(done.folder / "rig.usda"))
    session = stage.GetSessionLayer()
    session.SetPermissionToEdit(False)
    reference = stage.GetPrimAtPath("/Shot/Character").GetPrimIndex().rootNode.children[0]
    for target in (Usd.EditTarget(session), Usd.EditTarget(foreign, reference)):
        stage.SetEditTarget(target)
        with pytest.raises(OutputError, match="edit target"):
            apply(stage)


def test_a_program_without_the_schemas_composes_and_plays(done: Done) -> None:
    script = (
        "import sys, json; from pxr import Usd, UsdSkel, UsdGeom\n"
        "stage = Usd.Stage.Open(sys.argv[1])\n"
        "prim = stage.GetPrimAtPath('/Shot/Character/Face/Skel')\n"
        "query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(prim)).GetAnimQuery()\n"
        "take = stage.GetPrimAtPath('/Shot/Capture/Take')\n"
        "known = Usd.SchemaRegistry().FindConcretePrimDefinition('UsdFaceMarkerTake')\n"
        "print(json.dumps([known is None, take.IsA(UsdGeom.Points),"
        " list(query.ComputeBlendShapeWeights(20))]))\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "PXR_PLUGINPATH_NAME"}
    output = subprocess.run(
        [sys.executable, "-W", "error", "-c", script, str(done.root)],
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    unknown, points, weights = json.loads(output.stdout)
    assert unknown and points and output.stderr == ""
    np.testing.assert_array_equal(weights, animation_of(done.root).weights[20])


# Clocks and units


@pytest.mark.parametrize("rate", [24.0, 60.0, 120.0])
def test_the_clock_does_not_change_the_weights(done: Done, tmp_path: Path, rate: float) -> None:
    root = process(make_world(rate=rate).write(tmp_path))
    stage = Usd.Stage.Open(str(root))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == rate
    played = animation_of(root)
    np.testing.assert_array_equal(played.times, np.arange(40))
    # But for the correction, which is blended in over a time, not over frames.
    solves = [animation_of(at, muted="express.usdc").weights for at in (root, done.root)]
    np.testing.assert_allclose(*solves, atol=EXACT)


@pytest.mark.parametrize("up", ["Y", "Z"])
@pytest.mark.parametrize("rig_unit", [1.0, 0.01, 0.001])
def test_units_and_up_axis_do_not_change_the_weights(
    done: Done, tmp_path: Path, rig_unit: float, up: str
) -> None:
    world = make_world()
    other = "Z" if up == "Y" else "Y"
    take = replace(world.take, meters_per_unit=0.01 if rig_unit == 1 else 0.001, up_axis=other)
    replace(world, take=take).write(tmp_path)
    restaged(tmp_path / "rig.usda", rig_unit, up)
    root = process(tmp_path)
    stage = Usd.Stage.Open(str(root))
    assert UsdGeom.GetStageMetersPerUnit(stage) == rig_unit
    assert UsdGeom.GetStageUpAxis(stage) == up
    np.testing.assert_allclose(
        animation_of(root).weights, animation_of(done.root).weights, atol=EXACT
    )
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    markers = stage.GetPrimAtPath("/Shot/Capture/Take")
    to_world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(markers))
    for code in (0, 13, 30):
        recorded = np.array(markers.GetAttribute("points").Get(code))
        local = np.array(retarget.GetAttribute("usdface:featurePoints").Get(code))
        head = np.array(retarget.GetAttribute("usdface:head:transform").Get(code))
        np.testing.assert_allclose(
            local @ head[:3, :3] + head[3, :3],
            recorded @ to_world[:3, :3] + to_world[3, :3],
            atol=1e-6 / rig_unit,
        )


def test_a_stage_of_another_clock_plays_at_the_same_seconds(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    stage = Usd.Stage.Open(str(own_stage(clock=24)))
    assert stage.GetTimeCodesPerSecond() == 24
    played = animation_of(stage)
    np.testing.assert_allclose(played.times / 24, done.world.take.times, atol=1e-9)
    np.testing.assert_array_equal(played.weights, animation_of(done.root).weights)


# Rigs


def without_animation(folder: Path) -> Path:
    """Take the SkelAnimation and all that names it out of a folder's rig."""
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    for prim in stage.Traverse():
        prim.RemoveProperty("skel:animationSource")
    stage.RemovePrim("/Asset/Face/Anim")
    stage.Save()
    return folder


def test_a_rig_without_an_animation_gets_one(tmp_path: Path) -> None:
    world = make_world()
    folder = without_animation(world.write(tmp_path))
    shot = shoot(folder)
    found = codes_in(report(tmp_path, "process", shot))
    assert "ANIMATION_CREATED" in found
    root = folder / "shot.usdface.usda"
    np.testing.assert_allclose(solved(root, world), world.weights, atol=EXACT)
    assert animation_of(root).names == world.rig.shape_names


def test_tokens_that_are_not_solved_keep_their_own_values(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    animation = UsdSkel.Animation.Get(stage, "/Asset/Face/Anim")
    # In another order than the mesh's, lacking one shape, and with two more.
    names = ("tongue", *reversed(world.rig.shape_names[1:]), "ears")
    animation.GetBlendShapesAttr().Set(names)
    animation.GetBlendShapeWeightsAttr().Set([0.25, *[0.5] * 11, 0.75])
    stage.Save()
    root = process(folder)
    played = animation_of(root)
    assert played.names == (*names, world.rig.shape_names[0])
    assert (played.column("tongue") == 0.25).all() and (played.column("ears") == 0.75).all()
    np.testing.assert_allclose(solved(root, world), world.weights, atol=EXACT)


def test_an_animated_token_that_is_not_solved_keeps_its_seconds(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    assert stage.GetTimeCodesPerSecond() == 24
    animation = UsdSkel.Animation.Get(stage, "/Asset/Face/Anim")
    animation.GetBlendShapesAttr().Set(["tongue", *world.rig.shape_names])
    for code, value in ((0, 0.0), (24 * world.take.times[-1], 1.0)):
        animation.GetBlendShapeWeightsAttr().Set([value, *[0.0] * 12], code)
    stage.Save()
    played = animation_of(process(folder))
    np.testing.assert_allclose(played.column("tongue"), np.arange(40) / 39, atol=1e-6)


def test_several_meshes_share_one_weight_for_one_name(tmp_path: Path) -> None:
    world = make_world(teeth=True)
    root = process(world.write(tmp_path, mesh="/Asset/Face/head"))
    played = animation_of(root)
    assert played.names == world.rig.shape_names
    raw = animation_of(root, muted="express.usdc").reordered(world.rig.meshes[0].shape_names)
    np.testing.assert_allclose(raw.weights, world.weights, atol=EXACT)
    assert (played.column("teethShow") == 0).all() and played.column("jawOpen").max() > 0.5


# Takes


def test_weights_recorded_by_a_phone_play_by_name(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    (folder / "bind.json").unlink()
    write_live_link(world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    shot = shoot(folder)
    assert "EXPRESS_SKIPPED" in codes_in(report(tmp_path, "process", shot))
    played = animation_of(folder / "shot.usdface.usda").reordered(world.rig.shape_names)
    np.testing.assert_allclose(played.weights, world.weights, atol=1e-6)


def test_weights_with_a_binding_are_corrected_like_markers(done: Done, tmp_path: Path) -> None:
    folder = done.world.write(tmp_path)
    write_live_link(done.world, folder / "phone.csv")
    run("take", folder / "phone.csv", "-o", folder / "take.usda")
    np.testing.assert_allclose(
        animation_of(process(folder)).weights, animation_of(done.root).weights, atol=1e-4
    )


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
    said = next(f for f in outcome["findings"] if f["code"] == "FRAME_UNSOLVED")
    assert "2 of 40 frames" in said["message"] and "frame 12" in said["message"]
    weights = solved(tmp_path / "shot.usdface.usda", world)
    line = np.linspace(weights[11], weights[14], 4)[1:3]
    assert np.abs(weights[12:14] - line).max() < 0.15
    seen = np.r_[0:12, 14:40]
    np.testing.assert_allclose(weights[seen], world.weights[seen], atol=1e-3)


def test_an_unnamed_neutral_is_said_to_be_the_first_frame(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    bind = {k: v for k, v in world.bind.items() if k != "neutral"}
    (folder / "bind.json").write_text(json.dumps(bind))
    files = ("--rig", folder / "rig.usda", "--take", folder / "take.usda")
    outcome = report(
        tmp_path, "shot", *files, "--bind", folder / "bind.json", "-o", folder / "shot.usda"
    )
    assert "NEUTRAL_ASSUMED" in codes_in(outcome)
    np.testing.assert_allclose(solved(process(folder), world), world.weights, atol=EXACT)


# What the user's own stage overrides


@pytest.fixture
def own_stage(done: Done, tmp_path: Path) -> Callable[..., Path]:
    """A function that processes a stage of the user's over the shot; it returns the result.

    Overs on /Shot/Fuzzy are given as USD text.
    """

    def processed(fuzzy: str = "", clock: int = 30) -> Path:
        shot = tmp_path / "mine.usda"
        shot.write_text(
            f'#usda 1.0\n(\n defaultPrim = "Shot"\n timeCodesPerSecond = {clock}\n'
            f" framesPerSecond = {clock}\n subLayers = [@{done.folder / 'shot.usda'}@]\n"
            ' metersPerUnit = 1\n upAxis = "Y"\n)\n'
            f'over "Shot" {{\nover "Fuzzy" {{\n{fuzzy}\n}}\n}}\n'
        )
        run("process", shot)
        return tmp_path / "mine.usdface.usda"

    return processed


def rules_of(done: Done, emotion: str) -> list[str]:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    return [
        prim.GetName()
        for prim in stage.GetPrimAtPath("/Shot/Fuzzy").GetChildren()
        if f"THEN {emotion} " in str(prim.GetAttribute("usdface:text").Get())
    ]


def test_an_empty_layer_over_the_shot_changes_nothing(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    np.testing.assert_array_equal(
        animation_of(own_stage()).weights, animation_of(done.root).weights
    )


def test_no_gain_is_no_correction(done: Done, own_stage: Callable[..., Path]) -> None:
    raw = animation_of(done.root, muted="express.usdc").weights
    np.testing.assert_array_equal(animation_of(own_stage("float usdface:gain = 0")).weights, raw)


def test_a_disabled_rule_takes_its_expression_away(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    smiling = rules_of(done, "joy")
    overs = "\n".join(f'over "{rule}" {{\nbool usdface:enabled = 0\n}}' for rule in smiling)
    changed, before = (animation_of(root).weights for root in (own_stage(overs), done.root))
    raw = animation_of(done.root, muted="express.usdc").weights
    smile = done.world.rig.shape_names.index("mouthSmileLeft")
    assert (before[:, smile] > raw[:, smile] + 0.05).any()
    np.testing.assert_array_equal(changed[:, smile], raw[:, smile])


def test_another_rule_text_gives_another_expression(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    rule = rules_of(done, "joy")[0]
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    text = stage.GetPrimAtPath(f"/Shot/Fuzzy/{rule}").GetAttribute("usdface:text").Get()
    swapped = text.replace("THEN joy", "THEN surprise")
    root = own_stage(f'over "{rule}" {{\nuniform string usdface:text = "{swapped}"\n}}')
    jaw = done.world.rig.shape_names.index("jawOpen")
    smiling = int(done.world.weights[:, 1].argmax())
    assert (
        animation_of(root).weights[smiling, jaw]
        > animation_of(done.root).weights[smiling, jaw] + 0.2
    )


# glTF


def test_the_gltf_has_the_same_weights_in_seconds(done: Done, tmp_path: Path) -> None:
    run(
        "process",
        done.folder / "shot.usda",
        "-o",
        tmp_path / "a.usda",
        "--gltf",
        tmp_path / "a.glb",
    )
    run("import", tmp_path / "a.glb", "-o", tmp_path / "back.usda")
    run("export", done.root, "-o", tmp_path / "b.glb")
    run("import", tmp_path / "b.glb", "-o", tmp_path / "exported.usda")
    played = animation_of(done.root)
    for name in ("back.usda", "exported.usda"):
        stage = Usd.Stage.Open(str(tmp_path / name))
        back = animation_of(stage)
        np.testing.assert_allclose(
            back.times / stage.GetTimeCodesPerSecond(), done.world.take.times, atol=1e-6
        )
        np.testing.assert_allclose(back.reordered(played.names).weights, played.weights, atol=1e-6)


def test_a_take_may_start_late_on_the_users_stage(done: Done, tmp_path: Path) -> None:
    write_take(done.world.take, tmp_path / "take.usda")
    shot = tmp_path / "late.usda"
    text = (done.folder / "shot.usda").read_text()
    text = text.replace("@./take.usda@</Take>", f"@{tmp_path / 'take.usda'}@ (offset = 1000)")
    shot.write_text(text.replace("@./rig.usda@", f"@{done.folder / 'rig.usda'}@"))
    run("process", shot)
    played = animation_of(tmp_path / "late.usdface.usda")
    np.testing.assert_array_equal(played.times, 1000 + np.arange(40))
    np.testing.assert_array_equal(played.weights, animation_of(done.root).weights)
    stage = Usd.Stage.Open(str(tmp_path / "late.usdface.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1000, 1039)
