"""A stage that was never a file is set up and retargeted in memory."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import World, animation_of, make_world

import usdface
from usdface import InputError, OutputError
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.schemas import tokens


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(head_moves=False)


@pytest.fixture
def stage(world: World, tmp_path: Path) -> Usd.Stage:
    """A host's scene with the character and nothing of ours, of which no file is left."""
    write_rig(world.rig, tmp_path / "rig.usda")
    stage = Usd.Stage.CreateInMemory()
    text = (tmp_path / "rig.usda").read_text()
    (tmp_path / "rig.usda").unlink()
    stage.GetRootLayer().ImportFromString(text)
    stage.GetRootLayer().timeCodesPerSecond = 24
    return stage


def bind_file(world: World, folder: Path) -> Path:
    return world.write(folder) / "bind.json"


def test_a_stage_that_was_never_a_file(stage: Usd.Stage, world: World, tmp_path: Path) -> None:
    result = usdface.set_up(stage, take=world.take, bind=bind_file(world, tmp_path))
    assert result.written == () and result.summary["markers_bound"] == len(world.points)
    prim = stage.GetPrimAtPath("/UsdFace/Retarget")
    assert prim.GetTypeName() == tokens.RETARGET
    applied = usdface.apply(stage)
    played = animation_of(stage).reordered(applied.value.weights.names)
    np.testing.assert_allclose(played.weights, applied.value.weights.weights, atol=1e-6)
    # 30 frames a second on a clock of 24: the samples lie between time codes.
    np.testing.assert_allclose(played.times / 24, world.take.times, atol=1e-6)
    solved = applied.value.solved.reordered(world.rig.shape_names)
    np.testing.assert_allclose(solved.weights, world.weights, atol=1e-3)


@pytest.mark.slow
def test_it_is_the_shot_that_files_make(stage: Usd.Stage, world: World, tmp_path: Path) -> None:
    bind = bind_file(world, tmp_path)
    usdface.set_up(stage, take=world.take, bind=bind)
    applied = usdface.apply(stage).value.weights
    shot = tmp_path / "shot.usda"
    usdface.make_shot(tmp_path / "rig.usda", tmp_path / "take.usda", shot, bind=bind)
    processed = usdface.process(shot).value.weights
    np.testing.assert_allclose(
        applied.reordered(processed.names).weights, processed.weights, atol=1e-4
    )


def test_a_take_begins_where_the_hosts_scene_does(
    stage: Usd.Stage, world: World, tmp_path: Path
) -> None:
    stage.GetRootLayer().timeCodesPerSecond = 30
    usdface.set_up(stage, take=world.take, bind=bind_file(world, tmp_path), start_code=1001.0)
    codes = stage.GetAttributeAtPath("/UsdFace/Take.points").GetTimeSamples()
    assert codes == [1001.0 + frame for frame in range(len(world.take.times))]
    usdface.apply(stage)
    np.testing.assert_allclose(animation_of(stage).times, codes)  # which it leaves in codes


def test_a_take_on_the_stage_is_used_where_it_lies(
    stage: Usd.Stage, world: World, tmp_path: Path
) -> None:
    write_take(world.take, tmp_path / "recorded.usda")
    capture = stage.DefinePrim("/Capture")
    capture.GetReferences().AddReference(str(tmp_path / "recorded.usda"))
    usdface.set_up(stage, take="/Capture", bind=bind_file(world, tmp_path), scope="/Scene/Face")
    assert stage.GetPrimAtPath("/Scene/Face/Retarget")
    assert not stage.GetPrimAtPath("/Scene/Face/Take")
    assert usdface.apply(stage).summary["frames"] == len(world.take.times)
    with pytest.raises(InputError, match="no take at </Nowhere>"):
        usdface.set_up(stage, take="/Nowhere", scope="/Scene/Face")


def test_again_replaces_and_elsewhere_is_refused(
    stage: Usd.Stage, world: World, tmp_path: Path
) -> None:
    bind = bind_file(world, tmp_path)
    usdface.set_up(stage, take=world.take, bind=bind)
    first = stage.GetRootLayer().ExportToString()
    usdface.set_up(stage, take=world.take, bind=bind)
    assert stage.GetRootLayer().ExportToString() == first
    with pytest.raises(InputError, match="a setup at </UsdFace/Retarget> already"):
        usdface.set_up(stage, take=world.take, bind=bind, scope="/Other")


def test_only_the_edit_target_is_authored_on(
    stage: Usd.Stage, world: World, tmp_path: Path
) -> None:
    bind = bind_file(world, tmp_path)
    before = stage.GetRootLayer().ExportToString()
    stage.SetEditTarget(stage.GetSessionLayer())
    usdface.set_up(stage, take=world.take, bind=bind)
    assert stage.GetRootLayer().ExportToString() == before
    assert stage.GetSessionLayer().GetPrimAtPath("/UsdFace/Retarget")


def test_a_layer_that_cannot_hold_it_is_refused(
    stage: Usd.Stage, world: World, tmp_path: Path
) -> None:
    bind = bind_file(world, tmp_path)
    slow = Sdf.Layer.CreateAnonymous(".usda")
    stage.GetRootLayer().subLayerPaths = [slow.identifier]
    stage.GetRootLayer().subLayerOffsets[0] = Sdf.LayerOffset(10, 2)
    stage.SetEditTarget(stage.GetEditTargetForLocalLayer(slow))
    with pytest.raises(OutputError, match="a clock of its own"):
        usdface.set_up(stage, take=world.take, bind=bind)
    stage.SetEditTarget(stage.GetRootLayer())
    stage.GetRootLayer().SetPermissionToEdit(False)
    with pytest.raises(OutputError, match="cannot be authored on"):
        usdface.set_up(stage, take=world.take, bind=bind)
    assert not slow.rootPrims and not stage.GetPrimAtPath("/UsdFace")
