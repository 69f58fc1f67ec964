"""Rigs with another animation than the take asks for, or none, or several meshes."""

from pathlib import Path

import numpy as np
import pytest
from processed import EXACT, codes_in, process, report, shoot, solved, without_animation
from pxr import Usd, UsdSkel
from worlds import animation_of, make_world


@pytest.mark.slow
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


@pytest.mark.slow
def test_several_meshes_share_one_weight_for_one_name(tmp_path: Path) -> None:
    world = make_world(teeth=True)
    root = process(world.write(tmp_path, mesh="/Asset/Face/head"))
    played = animation_of(root)
    assert played.names == world.rig.shape_names
    raw = animation_of(root, muted="express.usdc").reordered(world.rig.meshes[0].shape_names)
    np.testing.assert_allclose(raw.weights, world.weights, atol=EXACT)
    assert (played.column("teethShow") == 0).all() and played.column("jawOpen").max() > 0.5
