"""Processed again, and elsewhere: the same bytes, and nothing else is touched."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from processed import Done, digests, process, run, shoot, without_animation
from pxr import Sdf
from worlds import animation_of, make_world


@pytest.mark.parametrize("strip", [pytest.param(False, marks=pytest.mark.slow), True])
def test_a_second_run_changes_no_byte(tmp_path: Path, strip: bool) -> None:
    folder = make_world().write(tmp_path)
    if strip:
        without_animation(folder)
    process(folder, "--gltf", folder / "face.glb")
    first = digests(folder)
    process(folder, "--gltf", folder / "face.glb")
    assert digests(folder) == first


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("strip", [pytest.param(False, marks=pytest.mark.slow), True])
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


@pytest.mark.slow
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
