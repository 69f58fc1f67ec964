from dataclasses import replace

import numpy as np
import pytest
from eye_rig import with_eyes
from worlds import make_world

from usdface.face.eye_joints import eye_joints, is_turned_by_shapes
from usdface.rigs import BlendShape, Rig


@pytest.fixture(scope="module")
def rig() -> Rig:
    return make_world().rig


@pytest.mark.parametrize(
    "names",
    [
        ("LeftEye", "RightEye"),
        ("eye.L", "eye.R"),
        ("J_Adj_L_FaceEye", "J_Adj_R_FaceEye"),
        ("mixamorig:LeftEye", "mixamorig:RightEye"),
        ("FACIAL_L_Eye", "FACIAL_R_Eye"),
        ("CC_Base_L_Eye", "CC_Base_R_Eye"),
        ("lEye", "rEye"),
        ("Bip01 LEyeball", "Bip01 REyeball"),
    ],
)
def test_joints_of_eyes_are_known_by_their_names(rig: Rig, names: tuple[str, str]) -> None:
    assert eye_joints(with_eyes(rig, names)) == {"left": 2, "right": 3}


@pytest.mark.parametrize(
    "names",
    [
        ("eyelid_L", "eyelid_R"),
        ("FACIAL_L_EyelidUpperA", "FACIAL_R_EyelidUpperA"),
        ("eye_target_L", "eye_target_R"),
        ("LeftEyeTop", "RightEyeTop"),
        ("Eyes", "Eye"),
        ("eyebrow.L", "eyebrow.R"),
    ],
)
def test_joints_of_lids_and_targets_are_none(rig: Rig, names: tuple[str, str]) -> None:
    assert eye_joints(with_eyes(rig, names)) == {}


def test_of_several_that_which_has_the_skin(rig: Rig) -> None:
    both = with_eyes(rig, ("eye.L", "eye.R"))
    skeleton = both.skeleton
    named = ("DEF-eye.L", "Head", *skeleton.names[2:])  # the neck's joint has no skin
    assert eye_joints(replace(both, skeleton=replace(skeleton, names=named))) == {
        "left": 2,
        "right": 3,
    }
    bare = replace(both, meshes=both.meshes[:1])
    assert eye_joints(bare) == {}


def test_no_skeleton_has_none(rig: Rig) -> None:
    assert eye_joints(rig) == {}


@pytest.mark.parametrize(
    ("name", "size", "turned"),
    [
        ("eyeLookInLeft", 0.004, True),
        ("lookUp", 0.004, True),
        ("eyeLookInLeft", 0.0004, False),  # follows by a tenth of a degree
        ("eyeBlinkLeft", 0.004, False),  # pushes the eye back
    ],
)
def test_eyes_that_shapes_of_gaze_turn(rig: Rig, name: str, size: float, turned: bool) -> None:
    eyes = with_eyes(rig)
    face, left, right = eyes.meshes
    shape = BlendShape(name, [0, 1], np.array([[size, 0, 0], [-size, 0, 0]]))
    shaped = replace(eyes, meshes=(face, replace(left, shapes=(shape,)), right))
    assert is_turned_by_shapes(shaped, 2) is turned
    assert not is_turned_by_shapes(shaped, 3) and not is_turned_by_shapes(eyes, 2)
