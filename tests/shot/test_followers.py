"""Blend shapes of other meshes that follow the face's, in every layer of a result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import EXACT, process, shoot
from pxr import Usd
from worlds import World, animation_of, make_world

import usdface
from usdface.rigs import Mesh, Rig
from usdface.shot.followers import followers, with_followers
from usdface.shot.shot import Shot
from usdface.takes import WeightsTake


def named_after_nodes(world: World) -> World:
    """The face and the teeth as Maya names their blend shapes: each by a node of its own."""
    meshes = [_named(mesh, f"{mesh.name}_bs.") for mesh in world.rig.meshes]
    return replace(world, rig=Rig("face", tuple(meshes)))


def _named(mesh: Mesh, node: str) -> Mesh:
    return replace(mesh, shapes=tuple(replace(s, name=node + s.name) for s in mesh.shapes))


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    world = named_after_nodes(make_world(teeth=True))
    return process(world.write(tmp_path_factory.mktemp("nodes")))


@pytest.mark.parametrize("muted", ["express.usdc", "closure.usdc", ""])
def test_teeth_open_with_the_jaw_in_every_layer(result: Path, muted: str) -> None:
    played = animation_of(result, muted=muted)
    jaw = played.weights[:, played.names.index("head_bs.jawOpen")]
    teeth = played.weights[:, played.names.index("teeth_bs.jawOpen")]
    np.testing.assert_allclose(teeth, jaw, atol=1e-6)
    assert teeth.max() > 0.5
    assert not played.weights[:, played.names.index("teeth_bs.teethShow")].any()


def test_names_after_nodes_change_no_weight(result: Path, tmp_path: Path) -> None:
    plain = animation_of(process(make_world(teeth=True).write(tmp_path)))
    named = animation_of(result)
    for name in make_world().rig.shape_names:
        own = named.weights[:, named.names.index(f"head_bs.{name}")]
        np.testing.assert_allclose(own, plain.weights[:, plain.names.index(name)], atol=EXACT)


@pytest.mark.parametrize(
    ("moving", "expected"),
    [
        ((), {"teeth_bs.jawOpen": "head_bs.jawOpen", "lash_bs.eyeBlink_L": "head_bs.eyeBlink_L"}),
        (("teeth_bs.jawOpen",), {"lash_bs.eyeBlink_L": "head_bs.eyeBlink_L"}),
    ],
)
def test_who_follows(moving: tuple[str, ...], expected: dict[str, str]) -> None:
    face = ("head_bs.jawOpen", "head_bs.eyeBlink_L", "head_bs.jaw_open")
    others = ("teeth_bs.jawOpen", "lash_bs.eyeBlink_L", "hat_bs.tilt", "teeth:jawOpen")
    assert followers((*face, *others), face, moving) == expected


def test_names_that_were_counted_through_follow_by_their_own_ones() -> None:
    labels = {"smile3": "smile", "brow2": "brow", "smile_2": "smile"}
    face, others = ("smile3", "brow"), ("smile", "brow2", "smile_2", "smile4")
    expected = {"smile": "smile3", "brow2": "brow"}
    assert followers((*face, *others), face, labels=labels) == expected


def test_a_follower_changes_by_as_much_and_stays_within_0_and_1() -> None:
    before, after = np.array([[0.2, 0.3, 0.5]]), np.array([[0.9, 0.3, 0.5]])
    moved = with_followers({"b": "a", "c": "a", "d": "a"}, ("a", "b", "c"), before, after)
    np.testing.assert_allclose(moved, [[0.9, 1.0, 1.0]])
    assert with_followers({}, ("a", "b", "c"), before, after) is after


@pytest.mark.parametrize(
    ("other", "face", "lead"),
    [
        (
            "beard_bs.mouthFunnelDown_L",
            ("head_bs.mouthFunnelUp_L", "head_bs.mouthFunnelDown_L"),
            "head_bs.mouthFunnelDown_L",
        ),
        ("head_blendShape.smile", ("smile",), "smile"),
        ("eyeShape.open", ("mouthShape.open",), None),
        ("lash_bs.Open", ("open",), None),
        ("lash_bs.jawOpen", ("jaw_open",), None),
        ("hat_blendShape_1", ("1",), None),
        ("-", ("_",), None),
        ("teeth_bs.open", ("jaw_bs.open", "lid_bs.open"), None),  # which of them?
    ],
)
def test_only_the_node_before_a_name_may_differ(
    other: str, face: tuple[str, ...], lead: str | None
) -> None:
    assert followers((*face, other), face) == ({other: lead} if lead else {})


def test_a_follower_that_was_corrected_itself_does_not_follow_too() -> None:
    before, after = np.array([[0.0, 0.0, 0.0]]), np.array([[0.4, 0.4, 1.2]])
    moved = with_followers({"b": "a", "c": "a"}, ("a", "b", "c"), before, after)
    np.testing.assert_array_equal(moved, after)


def test_the_report_names_what_is_followed(tmp_path: Path) -> None:
    done = usdface.process(shoot(named_after_nodes(make_world(teeth=True)).write(tmp_path)))
    (found,) = [each for each in done.findings if each.code == "SHAPES_FOLLOW"]
    assert found.values["shapes"] == ["teeth_bs.jawOpen"]
    assert found.values["leads"] == ["head_bs.jawOpen"]


def test_what_followed_in_a_result_on_the_stage_follows_again(tmp_path: Path) -> None:
    shot = shoot(named_after_nodes(make_world(teeth=True)).write(tmp_path))
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    usdface.apply(stage)
    more = usdface.ProcessOptions(exaggeration={"face": 0.5})
    weights = usdface.apply(stage, options=more).value.weights
    jaw, teeth = (weights.names.index(f"{node}_bs.jawOpen") for node in ("head", "teeth"))
    np.testing.assert_allclose(weights.weights[:, teeth], weights.weights[:, jaw], atol=1e-6)
    first = usdface.process(shot, options=more).value.weights
    np.testing.assert_allclose(weights.weights, first.weights, atol=1e-6)


def test_what_the_base_moves_otherwise_does_not_follow() -> None:
    world = named_after_nodes(make_world(teeth=True))
    frames = len(world.take.times)
    names, own = ("head_bs.jawOpen", "teeth_bs.jawOpen"), np.linspace(0.0, 1.0, frames)
    for lead, expected in ((own, {names[1]: names[0]}), (own / 2, {})):
        base = WeightsTake(names, world.take.times, np.stack([lead, own], axis=1))
        assert Shot(world.rig, world.take, world.setup(), base=base).followers == expected
