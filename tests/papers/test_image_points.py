"""The RBF paper's way from an image, on a face whose every point is known."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.cli import main
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace, bound_face
from usdface.io.bind_file import read_bind
from usdface.io.usd.take_write import write_take
from usdface.papers.image_points import compare_ways
from usdface.retarget.rbf import fit_paper_map
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

SCALE = 4000.0  # pixels a metre


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(head_moves=False)


def seen_from_afar(world: World) -> MarkerTake:
    """The markers as an image of 1280 x 960 from far in front shows them: y up."""
    flat = world.take.positions[..., :2] * SCALE + (640, -480)
    return replace(world.take, positions=flat, image_size=(1280, 960), focal_length=100_000.0)


def performed(world: World) -> WeightsTake:
    names = world.rig.meshes[0].shape_names
    return WeightsTake(names, world.take.times, world.weights, world.take.rate)


def bound(world: World, folder: Path) -> tuple[BoundFace, RetargetSetup]:
    world.write(folder)
    setup, _ = read_bind(folder / "bind.json")
    return bound_face(world.rig.meshes[0], setup), setup


def test_the_papers_points_are_those_of_its_equations(world: World, tmp_path: Path) -> None:
    face, setup = bound(world, tmp_path)
    take = seen_from_afar(world)
    result, _ = compare_ways(take, face, setup, reference=performed(world), test_frame=30)
    rest = take.select(result.markers)[:NEUTRAL].mean(axis=0)
    assert result.radius == pytest.approx(
        min(np.linalg.norm(a - b) for i, a in enumerate(rest) for b in rest[:i])
    )
    space = fit_paper_map(rest, result.train_target)
    assert np.allclose(result.points["paper"], space(take.select(result.markers)[30]))
    assert np.allclose(result.train_source, rest * [1, -1])


@pytest.mark.slow
def test_errors_are_distances_from_the_performed_face(world: World, tmp_path: Path) -> None:
    face, setup = bound(world, tmp_path)
    result, _ = compare_ways(seen_from_afar(world), face, setup, reference=performed(world))
    moved = np.linalg.norm(result.points["reference"] - result.train_target, axis=1)
    assert moved.max() > 0.005  # the test frame is an expression
    away = 1000 * np.linalg.norm(result.points["default"] - result.points["reference"], axis=1)
    scores = {score.name: score for score in result.scores}
    assert scores["default"].frame == pytest.approx(np.sqrt((away**2).mean()))
    assert scores["default"].largest == pytest.approx(away.max())
    assert scores["default"].film < 0.3
    assert scores["default"].weights < scores["paper, solved"].weights
    assert scores["paper"].film > scores["default"].film  # it has no depth of the expression


@pytest.mark.slow
def test_without_a_reference_there_are_points_and_no_errors(world: World, tmp_path: Path) -> None:
    face, setup = bound(world, tmp_path)
    result, _ = compare_ways(seen_from_afar(world), face, setup)
    assert set(result.points) == {"paper", "paper, solved", "default"}
    assert result.errors == {}
    assert result.as_dict()["ways"]["default"]["film_rms_mm"] is None


@pytest.mark.slow
def test_markers_in_space_and_frames_that_are_not_there_are_refused(
    world: World, tmp_path: Path
) -> None:
    face, setup = bound(world, tmp_path)
    with pytest.raises(InputError, match="take of an image"):
        compare_ways(world.take, face, setup)
    with pytest.raises(InputError, match="no frame 999"):
        compare_ways(seen_from_afar(world), face, setup, test_frame=999)


@pytest.mark.slow
def test_the_command_prints_the_quantities_of_table_1(
    world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    world.write(tmp_path)
    write_take(seen_from_afar(world), tmp_path / "image.usdc")
    write_take(performed(world), tmp_path / "curves.usdc")
    command = ["bench", "papers", "--images", str(tmp_path / "image.usdc")]
    command += ["--rig", str(tmp_path / "rig.usda"), "--bind", str(tmp_path / "bind.json")]
    command += ["--reference", str(tmp_path / "curves.usdc")]
    assert main([*command, "--report", str(tmp_path / "points.json")]) == 0
    text = capsys.readouterr().out
    assert "neutral [px]" in text
    assert "off, paper" in text
    document = json.loads((tmp_path / "points.json").read_text())
    assert len(document["points_mm"]["paper"]) == len(document["markers"]) == len(world.points)
    assert main(["bench", "papers", "--images", str(tmp_path / "image.usdc")]) == 1
    assert "belong together" in capsys.readouterr().err
