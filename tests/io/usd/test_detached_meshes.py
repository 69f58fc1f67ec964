"""Meshes near the face that the head's motion leaves behind are named."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from eye_rig import with_eyes
from processed import shoot
from pxr import Sdf, Usd
from worlds import World, make_world

from usdface.findings import Finding
from usdface.pipeline import process

EYE = "/Asset/Face/eye_l"


def world_with_eyes(bound: bool = True) -> World:
    world = make_world()
    rig = with_eyes(world.rig)
    if not bound:
        rig = replace(rig, meshes=tuple(replace(mesh, skin=None) for mesh in rig.meshes))
        rig = replace(rig, skeleton=None)
    return replace(world, rig=rig)


@pytest.fixture
def left(tmp_path: Path) -> Callable[..., list[Finding]]:
    """A function that processes a world whose rig was changed; it returns what stays behind."""

    def of(
        world: World, change: Callable[[Usd.Stage], None] = lambda _: None, **bind: object
    ) -> list[Finding]:
        world.write(tmp_path, mesh="/Asset/Face/head", **bind)
        stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
        change(stage)
        stage.Save()
        found = process(shoot(tmp_path)).findings
        return [each for each in found if each.code == "MESHES_LEFT_BEHIND"]

    return of


def loose(stage: Usd.Stage) -> None:
    """Take the skin of an eye away."""
    for name in ("jointIndices", "jointWeights"):
        stage.GetPrimAtPath(EYE).RemoveProperty(f"primvars:skel:{name}")


def to_the_neck(stage: Usd.Stage) -> None:
    indices = stage.GetPrimAtPath(EYE).GetAttribute("primvars:skel:jointIndices")
    indices.Set([0] * len(indices.Get()))


def elsewhere(stage: Usd.Stage) -> None:
    """Put an eye beside the SkelRoot."""
    layer = stage.GetRootLayer()
    assert Sdf.CopySpec(layer, EYE, layer, "/Asset/eye")
    stage.RemovePrim(EYE)
    loose_eye = stage.GetPrimAtPath("/Asset/eye")
    for name in loose_eye.GetAuthoredPropertyNames():
        if "skel:" in name:
            loose_eye.RemoveProperty(name)


def moved(stage: Usd.Stage, *way: float) -> None:
    points = stage.GetPrimAtPath(EYE).GetAttribute("points")
    points.Set([point + type(point)(*way) for point in points.Get()])


def far(stage: Usd.Stage) -> None:
    loose(stage)
    moved(stage, 0, 0, 1)


def collar(stage: Usd.Stage) -> None:
    """Below the chin, where the neck carries it."""
    to_the_neck(stage)
    moved(stage, 0, -0.145, 0)


def hidden(stage: Usd.Stage) -> None:
    elsewhere(stage)
    stage.GetPrimAtPath("/Asset/eye").GetAttribute("visibility").Set("invisible")


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (loose, "/Shot/Character/Face/eye_l"),
        (to_the_neck, "/Shot/Character/Face/eye_l"),
        (elsewhere, "/Shot/Character/eye"),
        (far, ""),
        (collar, ""),
        (hidden, ""),
        (lambda _: None, ""),
    ],
)
def test_an_eye_that_does_not_go_with_the_head(
    left: Callable[..., list[Finding]], change: Callable[[Usd.Stage], None], name: str
) -> None:
    found = left(world_with_eyes(), change)
    assert [each.values["meshes"] for each in found] == ([[name]] if name else [])
    for each in found:
        assert each.values["joint"] == "neck/head" and 5 < each.values["distance_mm"] < 100


def test_a_head_that_stays_leaves_nothing_behind(left: Callable[..., list[Finding]]) -> None:
    assert left(world_with_eyes(), loose, move_head=False) == []


def test_all_below_a_skel_root_goes_with_it(left: Callable[..., list[Finding]]) -> None:
    """Of a rig without joints the SkelRoot moves, and with it what is below it alone."""

    def unskinned(stage: Usd.Stage) -> None:
        for prim in stage.Traverse():
            for name in ("jointIndices", "jointWeights"):
                prim.RemoveProperty(f"primvars:skel:{name}")

    assert left(world_with_eyes(bound=False), unskinned) == []


def test_the_way_is_that_of_the_head(left: Callable[..., list[Finding]]) -> None:
    (found,) = left(world_with_eyes(), loose)
    head = make_world().take.positions
    furthest = np.linalg.norm(head - head[0], axis=2).max() * 1000
    assert 0.3 * furthest < found.values["distance_mm"] < 2 * furthest
