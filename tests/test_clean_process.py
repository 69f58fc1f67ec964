"""Clean-up through the files: what `process` repairs, says and authors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd
from worlds import World, animation_of, make_world

from usdface.cli import main
from usdface.pipeline import apply
from usdface.schemas import tokens
from usdface.takes import MarkerTake

SPIKED, FRAME = "chin", 20


@pytest.fixture(scope="module")
def world() -> World:
    """The small world with one marker 3 cm away in one frame."""
    made = make_world()
    positions = made.take.positions.copy()
    positions[FRAME, made.take.names.index(SPIKED)] += [0.0, 0.0, 0.03]
    spiked = MarkerTake(made.take.names, made.take.times, positions, made.take.rate)
    return replace(made, take=spiked)


def processed(world: World, folder: Path, **bind: object) -> tuple[dict[str, object], Path]:
    world.write(folder, **bind)
    shot = folder / "shot.usda"
    sources = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    setup = ["--bind", folder / "bind.json", "-o", shot]
    assert main([str(a) for a in ("shot", *sources, *setup)]) == 0
    assert main(["process", str(shot), "--report", str(folder / "report.json")]) == 0
    report = json.loads((folder / "report.json").read_text())
    return report, folder / "shot.usdface.usda"


def codes(report: dict[str, object]) -> set[str]:
    return {finding["code"] for finding in report["findings"]}


def error(root: Path, world: World) -> float:
    played = animation_of(root, muted="express.usdc").reordered(world.rig.shape_names)
    return float(np.abs(played.weights - world.weights).max())


def test_a_spike_is_said_authored_and_does_no_harm(world: World, tmp_path: Path) -> None:
    report, root = processed(world, tmp_path)
    assert "MARKER_SPIKE" in codes(report)
    stage = Usd.Stage.Open(str(root))
    prim = stage.GetPrimAtPath("/Shot/Retarget")
    names = prim.GetAttribute(tokens.CLEAN_REPAIRS_MARKERS).Get()
    kinds = prim.GetAttribute(tokens.CLEAN_REPAIRS_KINDS).Get()
    spans = [tuple(span) for span in prim.GetAttribute(tokens.CLEAN_REPAIRS_FRAMES).Get()]
    assert (SPIKED, "spike", (FRAME, FRAME)) in zip(names, kinds, spans, strict=True)
    assert error(root, world) < 0.02


def test_it_can_be_left_out(world: World, tmp_path: Path) -> None:
    report, root = processed(world, tmp_path, clean=False, solve={"errors": "alike"})
    assert "MARKER_SPIKE" not in codes(report)
    stage = Usd.Stage.Open(str(root))
    prim = stage.GetPrimAtPath("/Shot/Retarget")
    assert not prim.GetAttribute(tokens.CLEAN_REPAIRS_MARKERS).Get()
    assert error(root, world) > 0.05


def test_a_spike_that_is_left_in_counts_less(world: World, tmp_path: Path) -> None:
    _, root = processed(world, tmp_path, clean=False)
    assert error(root, world) < 0.025


@pytest.mark.slow
def test_a_host_gets_the_repairs_too(world: World, tmp_path: Path) -> None:
    processed(world, tmp_path)
    stage = Usd.Stage.Open(str(tmp_path / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    apply(stage)
    authored = stage.GetPrimAtPath("/Shot/Retarget").GetAttribute(tokens.CLEAN_REPAIRS_MARKERS)
    assert SPIKED in authored.Get()
