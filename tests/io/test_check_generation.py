"""Files of several runs of one shot are told apart by the id of their generation."""

import shutil
from pathlib import Path

import pytest
from worlds import make_world

import usdface
from usdface.io.generation import gltf_generation
from usdface.options import ProcessOptions

OTHER = ProcessOptions(solve="frame")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a shot, its result and its glTF."""
    folder = tmp_path_factory.mktemp("made")
    world = make_world().write(folder)
    shot = folder / "shot.usda"
    usdface.make_shot(world / "rig.usda", world / "take.usda", shot, bind=world / "bind.json")
    usdface.process(shot, gltf=folder / "face.glb")
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "made"))


def mixed(*files: Path) -> list[str]:
    return [
        Path(f.where).name for f in usdface.check(files).findings if f.code == "GENERATION_MIXED"
    ]


def outdated(folder: Path, options: ProcessOptions, **places: Path) -> list[str]:
    found = usdface.process(folder / "shot.usda", options=options, **places).findings
    return [f.where for f in found if f.code == "GLTF_OUTDATED"]


@pytest.mark.slow
def test_one_run_is_one_generation(folder: Path) -> None:
    assert mixed(folder / "shot.usdface.usda", folder / "face.glb") == []
    assert outdated(folder, ProcessOptions()) == []  # the same again
    assert mixed(folder / "face.glb") == []


@pytest.mark.slow
def test_an_older_gltf_beside_newer_layers_is_named(folder: Path) -> None:
    assert outdated(folder, OTHER) == ["face.glb"]
    assert mixed(folder / "face.glb") == ["face.glb"]
    assert mixed(folder / "face.glb", folder / "shot.usdface.usda") == ["face.glb"]
    assert outdated(folder, OTHER, gltf=folder / "face.glb") == []
    assert mixed(folder / "face.glb", folder / "shot.usdface.usda") == []


@pytest.mark.slow
def test_a_gltf_elsewhere_is_compared_with_the_layers_that_are_named_with_it(folder: Path) -> None:
    (folder / "web").mkdir()
    glb = (folder / "face.glb").rename(folder / "web" / "face.glb")
    usdface.process(folder / "shot.usda", options=OTHER)
    assert mixed(glb) == []  # nothing to compare it with
    assert mixed(glb, folder / "shot.usdface.usda") == ["face.glb"]


@pytest.mark.parametrize("layer", ["shot.usdface/solve.usdc", "shot.usdface.usda"])
def test_an_older_layer_among_newer_ones_is_named(folder: Path, made: Path, layer: str) -> None:
    usdface.process(folder / "shot.usda", options=OTHER)
    shutil.copy(made / layer, folder / layer)
    assert mixed(folder / "shot.usdface.usda") == ["shot.usdface.usda"]


def test_export_of_a_result_is_of_its_generation(folder: Path) -> None:
    usdface.export_scene(folder / "shot.usdface.usda", folder / "again.glb")
    assert gltf_generation(folder / "again.glb") == gltf_generation(folder / "face.glb")
    usdface.export_scene(folder / "rig.usda", folder / "rig.glb")
    assert gltf_generation(folder / "rig.glb") is None


@pytest.mark.slow
def test_layers_that_were_added_to_the_shot_are_compared_too(folder: Path) -> None:
    usdface.process(folder / "shot.usda", in_place=True, gltf=folder / "own.glb")
    assert mixed(folder / "own.glb", folder / "shot.usda") == []
    usdface.process(folder / "shot.usda", in_place=True, options=OTHER)
    assert mixed(folder / "own.glb") == ["own.glb"]
