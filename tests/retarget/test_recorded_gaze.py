"""The gaze that a recorder saw beside the markers, on blend shapes of gaze and joints of eyes."""

from dataclasses import replace

import numpy as np
import pytest
from eye_rig import with_eyes
from worlds import World, make_world

import usdface
from usdface.arrays import FloatArray
from usdface.face.gaze_curves import GAZE_CURVES, gaze_angles
from usdface.options import SolveOptions
from usdface.retarget.recorded_eyes import recorded_eyes
from usdface.retarget.recorded_gaze import gaze_pins, gaze_shapes, recorded_gaze
from usdface.rigs import BlendShape, Rig
from usdface.setup.binding import Binding
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

SETUP = RetargetSetup(Binding(("a",), np.array([0])), neutral=(2, 4))


def a_take(gaze: FloatArray | None, blink: FloatArray | None = None) -> MarkerTake:
    frames = 30 if gaze is None else len(gaze)
    positions = np.zeros((frames, 1, 3))
    return MarkerTake(("a",), np.arange(frames) / 30.0, positions, 30.0, blink=blink, gaze=gaze)


def looking(seed: int = 0, frames: int = 30) -> FloatArray:
    """Return yaw and pitch within half a turn to a side (F, 2) [rad]."""
    return np.random.default_rng(seed).uniform(-0.3, 0.3, (frames, 2))


def test_the_gaze_counts_from_the_neutral_frames() -> None:
    gaze = looking()
    found = recorded_gaze(a_take(gaze), SETUP)
    np.testing.assert_allclose(found, gaze - np.median(gaze[2:5], axis=0))
    of_rig = recorded_gaze(a_take(gaze), replace(SETUP, neutral=None))
    np.testing.assert_array_equal(of_rig, gaze)


def test_eyes_of_a_blink_look_where_they_do_around_it() -> None:
    gaze, blink = np.zeros((60, 2)), np.zeros(60)
    gaze[:, 0] = np.linspace(0.0, 0.2, 60)
    gaze[20:26, 1] = -0.6  # lids that close are taken for eyes that look down
    blink[20:26] = 0.3
    found = recorded_gaze(a_take(gaze, blink), replace(SETUP, neutral=None))
    np.testing.assert_allclose(found[:, 0], gaze[:, 0], atol=1e-12)
    np.testing.assert_array_equal(found[:, 1], 0.0)


def test_a_face_that_is_lost_for_long_has_no_gaze() -> None:
    gaze = looking(frames=90)
    gaze[30:60] = gaze[:3] = np.nan
    found = recorded_gaze(a_take(gaze), SETUP)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(gaze))
    assert recorded_gaze(a_take(np.full((30, 2), np.nan)), SETUP) is None
    assert recorded_gaze(a_take(None), SETUP) is None
    one = np.full((30, 2), np.nan)
    one[7] = 0.1
    assert np.isfinite(recorded_gaze(a_take(one), SETUP)[:, 0]).tolist().count(True) == 1


@pytest.mark.parametrize(
    "names",
    [
        GAZE_CURVES,
        tuple(name.replace("Left", "_L").replace("Right", "_R") for name in GAZE_CURVES),
    ],
)
def test_pins_look_where_the_recording_says(names: tuple[str, ...]) -> None:
    gaze = looking()
    pins = gaze_pins(a_take(gaze), ("jawOpen", *names), SETUP)
    assert [pin.shape for pin in pins] == list(names)
    weights = np.stack([pin.weights for pin in pins], axis=1)
    angles = gaze_angles(tuple(pin.shape for pin in pins), weights)
    for eye in angles.values():
        np.testing.assert_allclose(eye, recorded_gaze(a_take(gaze), SETUP), atol=1e-9)
    assert np.minimum(weights[:, 0], weights[:, 1]).max() == 0.0  # in and out


def test_one_shape_for_both_eyes_and_pins_of_a_person_come_first() -> None:
    gaze = np.tile([0.3, 0.0], (30, 1))
    names = ("lookLeft", "lookRight", "lookUp", "lookDown")
    assert gaze_shapes(names) == names
    own = replace(SETUP, neutral=None, pins=(Pin("lookUp", [3], [1.0]),))
    pins = {pin.shape: pin for pin in gaze_pins(a_take(gaze), names, own)}
    assert set(pins) == {"lookLeft", "lookRight", "lookDown"}
    assert pins["lookLeft"].weights.min() > 0.4 and pins["lookRight"].weights.max() == 0.0


def test_it_may_be_left_to_the_lids() -> None:
    solved = replace(SETUP, solve=SolveOptions(gaze="solved"))
    assert gaze_pins(a_take(looking()), GAZE_CURVES, solved) == ()
    assert gaze_pins(a_take(looking()), ("jawOpen",), SETUP) == ()


@pytest.fixture(scope="module")
def world() -> World:
    """A face whose shapes of gaze move its lids, as a fifth of its smile does."""
    world = make_world()
    mesh = world.rig.meshes[0]
    smile = next(shape for shape in mesh.shapes if shape.name == "mouthSmileLeft")
    lids = tuple(BlendShape(name, smile.indices, 0.2 * smile.offsets) for name in GAZE_CURVES)
    shapes = (*mesh.shapes, *lids)
    return replace(world, rig=Rig("face", (replace(mesh, shapes=shapes),)))


@pytest.mark.parametrize("gaze_of", ["recorded", "solved"])
def test_the_solve_keeps_the_recorded_gaze(world: World, gaze_of: str) -> None:
    angles = 0.2 * np.sin(np.arange(len(world.take.times)) / 9.0)
    gaze = np.stack([angles, np.zeros(len(angles))], axis=1)
    setup = world.setup(solve=SolveOptions(gaze=gaze_of), neutral=(0, 3))
    take = replace(world.take, gaze=gaze)
    shot, _ = usdface.assemble_shot(world.rig, take, setup=setup)
    result = usdface.retarget(shot, options=usdface.ProcessOptions(express=False))
    found = gaze_angles(result.weights.names, result.weights.weights)["left"]
    expected = recorded_gaze(take, replace(setup, solve=SolveOptions()))
    follows = np.abs(found - expected).max() < 1e-6
    assert follows == (gaze_of == "recorded")
    codes = [each.code for each in result.findings]
    assert ("GAZE_RECORDED" in codes) == (gaze_of == "recorded")


def test_joints_of_eyes_turn_by_it_and_else_it_is_told() -> None:
    rig, gaze = with_eyes(make_world().rig), np.tile([0.2, 0.1], (30, 1))
    gaze[:2] = np.nan
    setup = replace(SETUP, neutral=None)
    motions, findings = recorded_eyes(a_take(gaze), rig, rig.meshes[0], setup)
    assert [found.code for found in findings] == ["GAZE_RECORDED", "GAZE_BY_JOINTS"]
    for each in motions:
        x, y, z = (each.motion.rotations @ [0.0, 0.0, 1.0]).T
        np.testing.assert_allclose(np.arctan2(x, z), 0.2)
        np.testing.assert_allclose(np.arctan2(y, np.hypot(x, z)), 0.1)
    bare = make_world().rig
    motions, findings = recorded_eyes(a_take(gaze), bare, bare.meshes[0], setup)
    assert motions == () and [found.code for found in findings] == ["GAZE_UNSHOWN"]
