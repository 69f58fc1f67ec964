import re

import pytest

from usdface.face.facs_names import ARKIT, ActionUnit
from usdface.face.shape_aliases import bare_name
from usdface.face.shape_names import shape_key


@pytest.mark.parametrize(
    ("name", "same"),
    [
        ("blendShape1.browDown_L", "browDownLeft"),  # Maya, and FBX made of it
        ("|face|head_bs.jawOpen", "jawOpen"),
        ("head_blendShapes_jawOpen", "jawOpen"),
        ("blendShape1_mouthSmile_L", "mouthSmileLeft"),
        ("rig:faceBS.mouthSmile_R", "mouthSmileRight"),
        ("rig:mouthSmile_R", "mouthSmileRight"),
        ("head_blendShape.smile", "smile"),
        ("eye.blink.L", "eyeBlinkLeft"),  # dots between words
        ("blendShape1.mouthSmile.L", "mouthSmileLeft"),
        ("mouthSmile.L", "mouthSmileLeft"),  # Blender
        ("A38_Mouth_Smile_Left", "mouthSmileLeft"),  # Character Creator
        ("Brow_Drop_L", "browDownLeft"),
        ("Brow_Raise_Inner_R", "browInnerUp_R"),
        ("Cheek_Raise_L", "cheekSquintLeft"),
        ("Mouth_Up_Upper_R", "mouthUpperUpRight"),
        ("Mouth_Roll_In_Lower", "mouthRollLower"),
        ("Mouth_L", "mouthLeft"),
        ("Eye_L_Look_L", "eyeLookOutLeft"),
        ("Eye_R_Look_L", "eyeLookInRight"),
        ("Eye_R_Look_Up", "eyeLookUpRight"),
        ("facs_bs_MouthSmileLeft_div2", "mouthSmileLeft"),  # Daz
        ("Genesis9__facs_ctrl_JawOpen", "jawOpen"),
        ("head__eCTRLMouthSmileL", "mouthSmileLeft"),
        ("CTRL_expressions_mouthCornerPullL", "mouthSmileLeft"),  # MetaHuman
        ("CTRL_expressions_browRaiseInR", "browInnerUp_R"),
        ("CTRL_expressions_eyeLookLeftR", "eyeLookInRight"),
        ("CTRL_expressions_mouthFunnelUL", "mouthFunnel_L"),
        ("CTRL_expressions_jawChinRaiseDR", "mouthShrugLower_R"),
        ("Face.M_F00_000_00_Fcl_ALL_Joy", "Fcl_ALL_Joy"),  # VRoid
    ],
)
def test_a_name_of_another_program_is_that_of_arkit(name: str, same: str) -> None:
    assert shape_key(name) == shape_key(same)


@pytest.mark.parametrize(
    "name",
    [
        "smile.L",
        "smile.001",
        "smile_L.001",
        "L",
        "vectCTRL",
        "Fcl_",
        ".",
        "",
        "a.",
        "a:",
        "A12",
        "eye.up",
        "faceShape.L",
        "faceShape.001",
        "blendShape1.",
        "blendShape1.L.001",
        "blendShape1.Left",
        "smileBlend.L.001",
        "lipShape.U",
        "Eyes:Closed",
        "Eyes:Closed_L",
        "jaw|open",
        "MyBlendShapes_1",
        "targetL.smile",
        "eyeShape.open",
        "A12_L",
    ],
)
def test_what_belongs_to_a_name_stays(name: str) -> None:
    assert bare_name(name) == name


def test_arkit_names_are_their_own() -> None:
    names = {n for unit in ARKIT.units for n, _ in ARKIT.names(ActionUnit(unit))}
    for name in names:
        assert shape_key(name)[0] == re.sub("(_[LR]|Left|Right)$", "", name).lower()
