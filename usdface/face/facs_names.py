"""Naming conventions: the blend shapes of each FACS action unit.

The numbers are those of P. Ekman, W. Friesen, J. Hager, "Facial Action Coding System", 2002; left
and right are the character's.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from usdface.errors import InputError

__all__ = [
    "ARKIT",
    "DAZ",
    "FACS",
    "MAKEHUMAN",
    "NAMING_CONVENTIONS",
    "UNITS",
    "VRM",
    "VRM_0",
    "ActionUnit",
    "NamingConvention",
    "action_unit",
]

UNITS: dict[int, str] = {
    1: "inner brow raiser",
    2: "outer brow raiser",
    4: "brow lowerer",
    5: "upper lid raiser",
    6: "cheek raiser",
    7: "lid tightener",
    9: "nose wrinkler",
    10: "upper lip raiser",
    12: "lip corner puller",
    14: "dimpler",
    15: "lip corner depressor",
    16: "lower lip depressor",
    17: "chin raiser",
    18: "lip pucker",
    20: "lip stretcher",
    22: "lip funneler",
    23: "lip tightener",
    24: "lip pressor",
    25: "lips part",
    26: "jaw drop",
    27: "mouth stretch",
    28: "lip suck",
    29: "jaw thrust",
    34: "cheek puff",
    43: "eyes closed",
    61: "eyes turn left",
    62: "eyes turn right",
    63: "eyes up",
    64: "eyes down",
}


@dataclass(frozen=True, slots=True)
class ActionUnit:
    """An action unit of the whole face, or of its left or right half."""

    number: int
    side: Literal["", "L", "R"] = ""

    def __str__(self) -> str:
        return f"AU{self.number}{self.side}"


def action_unit(text: str) -> ActionUnit:
    """Read ``12``, ``AU12`` or ``AU12L``.

    Raises
    ------
    InputError
        If it is not one of `UNITS`.
    """
    found = re.fullmatch(r"(?:AU)?(\d{1,2})([LR]?)", text, re.ASCII | re.IGNORECASE)
    if not found or int(found[1]) not in UNITS:
        raise InputError(
            f"{text!r} is no action unit; expected 12, AU12 or AU12L, of "
            f"{', '.join(map(str, UNITS))}"
        )
    side: Literal["", "L", "R"] = "L" if found[2] in ("L", "l") else "R" if found[2] else ""
    return ActionUnit(int(found[1]), side)


@dataclass(frozen=True, slots=True)
class NamingConvention:
    """A naming convention: the blend shapes of each action unit, with their weights.

    `{side}` in a name is replaced by each of `sides`; names that a rig lacks are left out. A name
    without a side is of both halves.
    """

    name: str
    sides: tuple[str, ...]
    units: Mapping[int, Mapping[str, float]]

    def names(self, unit: ActionUnit) -> Iterator[tuple[str, float]]:
        """Return every name of the unit's blend shapes, with its weight.

        Of a unit of one half: the names of that half, and those without a side.
        """
        wanted = ("", unit.side) if unit.side else ("", "L", "R")
        sides = [side for side in self.sides if side.strip("_")[:1].upper() in wanted]
        for template, weight in self.units.get(unit.number, {}).items():
            names = dict.fromkeys(template.format(side=side) for side in sides)
            yield from ((name, weight) for name in names)


# ARKit's 52 blend shapes. ICT-FaceKit and others use _L, _R, and some split browInnerUp.
ARKIT = NamingConvention(
    "ARKit",
    ("Left", "Right", "_L", "_R", ""),
    {
        1: {"browInnerUp{side}": 1.0},
        2: {"browOuterUp{side}": 1.0},
        4: {"browDown{side}": 1.0},
        5: {"eyeWide{side}": 1.0},
        6: {"cheekSquint{side}": 1.0},
        7: {"eyeSquint{side}": 1.0},
        # The nose wrinkler pulls the upper lip along; ARKit has a blend shape for that.
        9: {"noseSneer{side}": 1.0, "mouthUpperUp{side}": 0.5},
        10: {"mouthUpperUp{side}": 1.0},
        12: {"mouthSmile{side}": 1.0},
        14: {"mouthDimple{side}": 1.0},
        15: {"mouthFrown{side}": 1.0},
        16: {"mouthLowerDown{side}": 1.0},
        17: {"mouthShrugLower": 1.0},
        18: {"mouthPucker": 1.0},
        20: {"mouthStretch{side}": 1.0},
        22: {"mouthFunnel": 1.0},
        23: {"mouthPress{side}": 1.0, "mouthRollLower": 0.3, "mouthRollUpper": 0.3},
        24: {"mouthPress{side}": 1.0},
        25: {"mouthUpperUp{side}": 0.3, "mouthLowerDown{side}": 0.3},
        26: {"jawOpen": 1.0},
        27: {"jawOpen": 1.0},
        28: {"mouthRollLower": 1.0, "mouthRollUpper": 1.0},
        29: {"jawForward": 1.0},
        34: {"cheekPuff{side}": 1.0},
        43: {"eyeBlink{side}": 1.0},
        61: dict.fromkeys(("eyeLookOutLeft", "eyeLookInRight", "eyeLookOut_L", "eyeLookIn_R"), 1.0),
        62: dict.fromkeys(("eyeLookInLeft", "eyeLookOutRight", "eyeLookIn_L", "eyeLookOut_R"), 1.0),
        63: {"eyeLookUp{side}": 1.0},
        64: {"eyeLookDown{side}": 1.0},
    },
)

# MakeHuman's expression units. They have no cheek raiser; narrowed lids replace it.
MAKEHUMAN = NamingConvention(
    "MakeHuman",
    ("left", "right"),
    {
        1: {"eyebrows-{side}-inner-up": 1.0},
        2: {"eyebrows-{side}-extern-up": 1.0},
        4: {"eyebrows-{side}-down": 1.0},
        5: {"eye-{side}-opened-up": 1.0},
        6: {"eye-{side}-slit": 0.5},
        7: {"eye-{side}-slit": 1.0},
        9: {"nose-{side}-elevation": 1.0, "nose-compression": 1.0, "mouth-elevation": 0.8},
        10: {"mouth-elevation": 1.0},
        12: {"mouth-corner-puller": 1.0},
        14: {"mouth-compression": 1.0},
        15: {"mouth-depression": 1.0},
        16: {"mouth-depression-retraction": 1.0},
        17: {"mouth-elevation": 0.8},
        18: {"mouth-pursing": 1.0},
        20: {"mouth-retraction": 1.0, "neck-platysma": 0.6},
        22: {"mouth-protusion": 1.0},
        23: {"mouth-eversion": 0.8},
        25: {"mouth-parling": 1.0},
        26: {"mouth-open": 0.8},
        27: {"mouth-open": 1.0},
        43: {"eye-{side}-closure": 1.0},
    },
)

# The presets of VRM 1.0 that are no emotions: blinks, gaze, and mouths that speak Japanese vowels,
# which are the nearest that it has to lips that part, stretch, pucker and funnel.
VRM = NamingConvention(
    "VRM",
    ("Left", "Right"),
    {
        18: {"ou": 1.0},
        20: {"ee": 1.0},
        22: {"oh": 1.0},
        25: {"ih": 1.0},
        26: {"aa": 1.0},
        43: {"blink{side}": 1.0},
        61: {"lookLeft": 1.0},
        62: {"lookRight": 1.0},
        63: {"lookUp": 1.0},
        64: {"lookDown": 1.0},
    },
)

# VRM 0.x: vowels in capitals, and VRoid's shapes, whose names its presets stand for.
VRM_0 = NamingConvention(
    "VRM 0",
    ("_L", "_R"),
    {
        1: {"Fcl_BRW_Sorrow": 1.0},
        2: {"Fcl_BRW_Surprised": 1.0},
        4: {"Fcl_BRW_Angry": 1.0},
        18: {"U": 1.0, "Fcl_MTH_U": 1.0},
        20: {"E": 1.0, "Fcl_MTH_E": 1.0},
        22: {"O": 1.0, "Fcl_MTH_O": 1.0},
        25: {"I": 1.0, "Fcl_MTH_I": 1.0},
        26: {"A": 1.0, "Fcl_MTH_A": 1.0},
        43: {"Blink{side}": 1.0, "Fcl_EYE_Close{side}": 1.0},
    },
)

# Daz's controls of Genesis 3 and 8 (``eCTRLEyesClosedL``); some avatars have their names beside
# ARKit's. Later figures have those of ARKit.
DAZ = NamingConvention(
    "Daz",
    ("_L", "_R", ""),
    {
        7: {"EyesSquint{side}": 1.0},
        12: {"MouthSmile{side}": 1.0},
        15: {"MouthFrown{side}": 1.0},
        18: {"LipsPucker": 1.0},
        26: {"MouthOpen": 0.8},
        27: {"MouthOpen": 1.0},
        34: {"CheeksBalloon": 1.0},
        43: {"EyesClosed{side}": 1.0},
    },
)

# Blend shapes that are named after the units: AU12, AU12_L, au01L, AU_06, FACS_AU4_left.
_SPELLINGS = ("AU{}", "AU_{}", "au{}", "au_{}", "FACS_AU{}", "FACS_{}")
FACS = NamingConvention(
    "FACS",
    ("_L", "_R", "L", "R", "_left", "_right", "Left", "Right", ""),
    {
        unit: {
            spelling.format(number) + side: 1.0
            for spelling in _SPELLINGS
            for number in (unit, f"{unit:02d}")
            for side in (("{side}",) if unit not in (61, 62) else ("",))
        }
        for unit in UNITS
    },
)

NAMING_CONVENTIONS = (ARKIT, MAKEHUMAN, VRM, VRM_0, DAZ, FACS)
