"""The eyes of a phone's recording on a character whose eyes turn by joints."""

from dataclasses import replace

import numpy as np
import pytest
from eye_rig import EYE_PLACES, with_eyes
from worlds import make_world

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.retarget.joint_motion import JointMotion
from usdface.retarget.recorded_eyes import recorded_eyes
from usdface.rigs import BlendShape, Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

SETUP = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=None)
NAMES = (
    *("eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeLookDownLeft"),
    *("eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight", "eyeLookDownRight"),
)
AHEAD = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def rig() -> Rig:
    return with_eyes(make_world().rig)


def looking(**weights: float) -> WeightsTake:
    rows = np.zeros((2, len(NAMES) + 1))
    for name, weight in weights.items():
        rows[1, NAMES.index(name)] = weight
    return WeightsTake((*NAMES, "jawOpen"), np.arange(2) / 30.0, rows, 30.0, source="phone.csv")


def directions(motions: tuple[JointMotion, ...]) -> FloatArray:
    """Where the eyes look in the second frame: (2, 3)."""
    return np.array([each.motion.rotations[1] @ AHEAD for each in motions])


@pytest.mark.parametrize(
    ("weights", "axis", "sign"),
    [
        ({"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}, 0, 1.0),  # +x is the face's left
        ({"eyeLookInLeft": 1.0, "eyeLookOutRight": 1.0}, 0, -1.0),
        ({"eyeLookUpLeft": 1.0, "eyeLookUpRight": 1.0}, 1, 1.0),
        ({"eyeLookDownLeft": 1.0, "eyeLookDownRight": 1.0}, 1, -1.0),
    ],
)
def test_eyes_look_where_the_curves_say(
    rig: Rig, weights: dict[str, float], axis: int, sign: float
) -> None:
    motions, findings = recorded_eyes(looking(**weights), rig, rig.meshes[0], SETUP)
    assert [each.joint for each in motions] == [2, 3]
    assert [found.code for found in findings] == ["GAZE_BY_JOINTS"]
    for gaze in directions(motions):
        assert sign * gaze[axis] > 0.4 and abs(gaze[1 - axis]) < 1e-12
    for each, place in zip(motions, EYE_PLACES, strict=True):
        np.testing.assert_allclose(each.motion.to_take(place[None, None])[:, 0] - place, 0.0)
        np.testing.assert_allclose(each.motion.rotations[0], np.eye(3))


def test_a_factor_turns_them_less_or_not_at_all(rig: Rig) -> None:
    take = looking(eyeLookUpLeft=1.0, eyeLookUpRight=1.0)
    whole, _ = recorded_eyes(take, rig, rig.meshes[0], SETUP)
    half, _ = recorded_eyes(take, rig, rig.meshes[0], replace(SETUP, eye_turn=0.5))
    pitch = [np.arcsin(directions(motions)[:, 1]) for motions in (whole, half)]
    np.testing.assert_allclose(pitch[1], pitch[0] / 2)
    assert recorded_eyes(take, rig, rig.meshes[0], replace(SETUP, eye_turn=0.0)) == ((), [])


def test_eyes_that_shapes_turn_stay_unless_their_joints_are_named(rig: Rig) -> None:
    face, left, right = rig.meshes
    offsets = np.full((4, 3), 0.004)
    moved = [
        replace(eye, shapes=(BlendShape(f"eyeLookUp{side}", [0, 1, 2, 3], offsets),))
        for eye, side in ((left, "Left"), (right, "Right"))
    ]
    shaped = replace(rig, meshes=(face, *moved))
    take = looking(eyeLookUpLeft=1.0)
    motions, findings = recorded_eyes(take, shaped, face, SETUP)
    assert motions == ()
    (found,) = findings  # of the other directions, which this rig lacks
    assert found.code == "CHANNEL_IGNORED" and "eyeLookUpLeft" not in found.values["channels"]
    named = replace(SETUP, eye_joints=("neck/head/eyeL", "RightEye"))
    motions, _ = recorded_eyes(take, shaped, face, named)
    assert [each.joint for each in motions] == [2, 3]
    with pytest.raises(InputError, match="'LeftEar'"):
        recorded_eyes(take, rig, face, replace(SETUP, eye_joints=("LeftEar", "RightEye")))


def test_gaze_without_joints_is_told() -> None:
    rig = make_world().rig
    motions, findings = recorded_eyes(looking(), rig, rig.meshes[0], SETUP)
    assert motions == ()
    (found,) = findings
    assert found.code == "CHANNEL_IGNORED" and sorted(found.values["channels"]) == sorted(NAMES)
    silent = WeightsTake(("jawOpen",), [0.0], np.zeros((1, 1)))
    assert recorded_eyes(silent, rig, rig.meshes[0], SETUP) == ((), [])
