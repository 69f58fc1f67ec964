"""Characters that are modelled or placed along another axis: corrected as if they looked ahead."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import process
from pxr import Usd, UsdGeom, UsdSkel
from sheets import sheet
from slits import slit_face
from worlds import World, animation_of, make_world

from usdface.face.facing import turn_about_up
from usdface.geometry.bake_transform import bake_transform
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.options import MarkerOptions
from usdface.pipeline import fit_fuzzy, make_markers
from usdface.rigs import Mesh, Rig


def modelled(mesh: Mesh, degrees: float) -> Mesh:
    """Return a face that looks to another side as modelled."""
    turn = turn_about_up(degrees)[:3, :3]
    shapes = tuple(replace(shape, offsets=shape.offsets @ turn) for shape in mesh.shapes)
    return replace(mesh, points=mesh.points @ turn, shapes=shapes)


def write_turned(world: World, folder: Path, axis: str, degrees: float) -> None:
    """Write a world whose stage turns the character about an axis."""
    world.write(folder)
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    root = UsdGeom.Xformable(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Root)))
    getattr(root, f"AddRotate{axis}Op")().Set(degrees)
    stage.Save()


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def ahead(world: World, tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return weights(world, tmp_path_factory.mktemp("ahead"))


def weights(world: World, folder: Path) -> np.ndarray:
    world.write(folder)
    return animation_of(process(folder)).reordered(world.rig.shape_names).weights


@pytest.mark.parametrize(
    "degrees",
    [90.0, 180.0, pytest.param(-90.0, marks=pytest.mark.slow), pytest.param(69.0, id="applied")],
)
def test_a_character_that_is_modelled_aside_gets_the_same_correction(
    world: World, ahead: np.ndarray, tmp_path: Path, degrees: float
) -> None:
    """Its rules, sides and regions are made at the shot; they were those of the other side."""
    mesh = modelled(world.rig.meshes[0], degrees)
    aside = replace(world, rig=replace(world.rig, meshes=(mesh,)))
    np.testing.assert_allclose(weights(aside, tmp_path), ahead, atol=1e-3)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 90.0, 180.0])
def test_the_rig_is_turned_by_what_turned_it(world: World, tmp_path: Path, degrees: float) -> None:
    write_turned(world, tmp_path, "Y", degrees)
    rig, turn, findings = front_facing_rig(open_stage(tmp_path / "rig.usda"))
    np.testing.assert_allclose(rig.meshes[0].points, world.rig.meshes[0].points, atol=1e-6)
    np.testing.assert_allclose(turn, turn_about_up(-degrees), atol=1e-6)
    assert [found.code for found in findings] == (["CHARACTER_TURNED"] if degrees else [])


@pytest.mark.parametrize("degrees", [-90.0, 90.0])
def test_a_character_that_lies_is_reported(world: World, tmp_path: Path, degrees: float) -> None:
    write_turned(world, tmp_path, "X", degrees)
    _, turn, findings = front_facing_rig(open_stage(tmp_path / "rig.usda"))
    np.testing.assert_array_equal(turn, np.eye(4))
    (lying,) = findings
    assert lying.code == "CHARACTER_LYING" and lying.action == "correct_stage"
    assert lying.values["pitch_degrees"] == pytest.approx(-degrees, abs=5.0)


def test_a_rig_without_blend_shapes_is_left_as_it_is(world: World, tmp_path: Path) -> None:
    mesh = replace(modelled(world.rig.meshes[0], 90.0), shapes=())
    replace(world, rig=replace(world.rig, meshes=(mesh,))).write(tmp_path)
    rig, turn, findings = front_facing_rig(open_stage(tmp_path / "rig.usda"))
    np.testing.assert_array_equal(turn, np.eye(4))
    assert not findings and not rig.meshes[0].shapes


def test_commands_on_the_rig_alone_turn_it_as_well(world: World, tmp_path: Path) -> None:
    """`usdface fuzzy fit` and `markers` on a rig along -z: rules and places of the one ahead."""
    aside = replace(world, rig=replace(world.rig, meshes=(modelled(world.rig.meshes[0], 180.0),)))
    systems, places = [], []
    for name, made in (("ahead", world), ("aside", aside)):
        (tmp_path / name).mkdir()
        made.write(tmp_path / name)
        rig, bind = tmp_path / name / "rig.usda", tmp_path / name / "bind.json"
        systems.append(fit_fuzzy(rig, tmp_path / name / "system.usda", bind=bind).value.system)
        found = make_markers(rig, bind=bind, options=MarkerOptions(count=2))
        places.append(found.summary["new_markers"])
    ahead, turned = systems
    assert [rule.text for rule in ahead.fuzzy.rules] == [rule.text for rule in turned.fuzzy.rules]
    assert places[0] == places[1]


def test_what_a_shot_keeps_by_reference_is_not_called_lost() -> None:
    stage = sheet()
    camera = UsdGeom.Camera.Define(stage, "/R/Cam")
    camera.CreateFStopAttr(2.8)
    UsdGeom.Xform.Define(stage, "/R/Locator").GetPrim().SetCustomDataByKey("note", "hat")
    lods = stage.GetPrimAtPath("/R").GetVariantSets().AddVariantSet("lod")
    lods.AddVariant("high")
    lods.AddVariant("low")
    assert {"FEATURE_DROPPED", "NODES_DROPPED", "CHANNEL_IGNORED"} <= {
        found.code for found in rig_of_stage(stage)[1]
    }
    assert front_facing_rig(stage)[2] == []


@pytest.mark.parametrize("degrees", [-40.0, 20.0, 35.0])
def test_points_that_are_turned_by_less_than_markers_tell_are_turned_back(
    degrees: float, tmp_path: Path
) -> None:
    face = slit_face()
    rig = Rig("Face", (bake_transform(face, turn_about_up(degrees)),))
    write_rig(rig, tmp_path / "rig.usdc")
    markers = np.arange(0, len(face.points) // 2, 3)  # uneven
    for bound in (np.zeros(0, dtype=np.int64), markers):
        found, _, findings = front_facing_rig(open_stage(tmp_path / "rig.usdc"), markers=bound)
        np.testing.assert_allclose(found.face().points, face.points, atol=2e-4)
        assert "CHARACTER_TURNED" in [f.code for f in findings]
