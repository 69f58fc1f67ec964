"""The whole way from files to files, on a world whose answer is known."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from processed import EXACT, Done, digests, process, run, solved, without_animation
from pxr import Sdf, Usd
from worlds import animation_of, make_world


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
