"""Every command that is given vertices without their mesh says of which mesh it takes them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from labelled_world import labelled_world
from processed import shoot
from pxr import Sdf
from worlds import make_world

from usdface.cli import main
from usdface.io.usd.take_write import write_take
from usdface.options import BindOptions
from usdface.pipeline import make_bind_page

NAMED = "usdface:bind:mesh"


def unnamed(folder: Path) -> None:
    """Give the head an eye with a blend shape; let the binding name no mesh."""
    world = make_world()
    (head,) = world.rig.meshes
    eye = replace(head, name="eye", shapes=head.shapes[:1], points=0.1 * head.points)
    both = replace(world, rig=replace(world.rig, meshes=(eye, head))).write(folder / "both")
    (folder / "rig.usda").write_bytes((both / "rig.usda").read_bytes())
    document = json.loads((folder / "bind.json").read_text())
    document.pop("mesh", None)
    (folder / "bind.json").write_text(json.dumps(document))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    labelled_world(tmp_path)
    unnamed(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def assumed(*command: str) -> list[tuple[str, str]]:
    """Run a command; return place and mesh of each MESH_ASSUMED."""
    assert main([*command, "--report", "report.json"]) == 0
    found = json.loads(Path("report.json").read_text())["findings"]
    return [(f["where"], f["values"]["mesh"]) for f in found if f["code"] == "MESH_ASSUMED"]


HEAD = "/Asset/Face/head"
WITH_BIND = (
    ("markers", "rig.usda", "--bind", "bind.json", "-o", "more.json"),
    (
        *("fuzzy", "fit", "--rig", "rig.usda", "--bind", "bind.json"),
        *("--labels", "labels.csv", "-o", "fitted.fll"),
    ),
    ("bind", "rig.usda", "--take", "take.usda", "--bind", "bind.json", "-o", "bind.html"),
)


@pytest.mark.parametrize("command", WITH_BIND, ids=[c[0] for c in WITH_BIND])
def test_commands_that_read_a_binding(folder: Path, command: tuple[str, ...]) -> None:
    assert assumed(*command) == [("bind.json", HEAD)]
    document = json.loads(Path("bind.json").read_text())
    Path("bind.json").write_text(json.dumps(document | {"mesh": "head"}))
    assert assumed(*command, *(["--overwrite"] if command[0] == "markers" else [])) == []


def test_a_shot_that_is_written_by_hand(folder: Path) -> None:
    shot = shoot(folder)
    assert assumed("process", "shot.usda") == []  # `usdface shot` names the mesh
    layer = Sdf.Layer.FindOrOpen(str(shot))
    assert layer.GetRelationshipAtPath(f"/Shot/Retarget.{NAMED}")
    prim = layer.GetPrimAtPath("/Shot/Retarget")
    prim.RemoveProperty(prim.relationships[NAMED])
    layer.Save()
    mesh = "/Shot/Character/Face/head"
    assert assumed("process", "shot.usda") == [("/Shot/Retarget", mesh)]
    assert assumed("bind", "shot.usda", "-o", "bind.html") == [("/Shot/Retarget", mesh)]


def test_a_page_for_a_take_of_which_nothing_can_be_proposed(folder: Path) -> None:
    take = make_world().take
    still = np.repeat(take.positions[:1], len(take.times), axis=0)
    write_take(replace(take, positions=still), folder / "still.usda")
    result = make_bind_page(
        "rig.usda",
        "bind.html",
        take="still.usda",
        bind="bind.json",
        binding=BindOptions(propose=True),
    )
    codes = [found.code for found in result.findings]
    assert codes.count("MESH_ASSUMED") == codes.count("PLACES_NOT_PROPOSED") == 1
