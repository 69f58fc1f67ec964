"""Movements that the names of blend shapes claim.

`usdface.face.facs_names` has the blend shapes that make up a unit, with stand-ins where a rig has
none of its own; here is the one movement that a name means. Names are read in any spelling.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from usdface.face.plain_names import shape_keys
from usdface.facs.movements import MOVEMENTS

__all__ = ["Claim", "claims_of"]

# ARKit's names; a name with a side is one of the two halves, or a direction.
_ARKIT = {
    **{"browinnerup": "1", "browouterup": "2", "browdown": "4", "eyewide": "5"},
    **{"cheeksquint": "6", "eyesquint": "7", "eyeblink": "43", "nosesneer": "9"},
    **{"mouthupperup": "10", "mouthsmile": "12", "mouthdimple": "14", "mouthfrown": "15"},
    **{"mouthlowerdown": "16", "mouthshruglower": "17", "mouthshrugupper": "17 upper"},
    **{"mouthpucker": "18", "mouthstretch": "20", "mouthfunnel": "22", "mouthpress": "24, 23"},
    **{"mouthrollupper": "28 upper", "mouthrolllower": "28 lower", "mouthclose": "8"},
    **{"jawopen": "26", "jawforward": "29", "cheekpuff": "34"},
    **{"eyelookup": "63", "eyelookdown": "64"},
}
_MAKEHUMAN = {
    **{"eyebrowsinnerup": "1", "eyebrowsexternup": "2", "eyebrowsup": "2", "eyebrowsdown": "4"},
    **{"eyeopenedup": "5", "eyeslit": "7", "eyeclosure": "43"},
    **{"noseelevation": "9", "nosedilatation": "38", "nosecompression": "9 root"},
    **{"mouthelevation": "10, 9", "mouthcornerpuller": "12", "mouthretraction": "14, 20"},
    **{"mouthdepression": "15", "mouthdepressionretraction": "16, 25", "mouthparling": "25"},
    **{"mouthpartlater": "25", "mouthpursing": "18", "mouthprotusion": "22"},
    **{"moutheversion": "22 lower", "mouthopen": "26", "neckplatysma": "20"},
}
_VRM = {
    **{"aa": "26", "ih": "25", "ou": "18", "ee": "20", "oh": "22"},
    **{"blink": "43", "lookup": "63", "lookdown": "64"},
}
_WHOLE_NAMES = MappingProxyType(_ARKIT | _MAKEHUMAN | _VRM)
# Names whose side is a direction: movement and half.
_DIRECTED = {
    ("jaw", "left"): ("30L", ""),
    ("jaw", "right"): ("30R", ""),
    ("mouth", "left"): ("mouth left", ""),
    ("mouth", "right"): ("mouth right", ""),
    ("eyelookout", "left"): ("61", "L"),
    ("eyelookin", "left"): ("62", "L"),
    ("eyelookin", "right"): ("61", "R"),
    ("eyelookout", "right"): ("62", "R"),
    ("look", "left"): ("61", ""),
    ("look", "right"): ("62", ""),
}
# Blend shapes named after the units: AU12, au01_L, FACS_AU4_left.
_UNIT = re.compile(r"(?:facs)?(?:au)?_?0?(\d{1,2})", re.ASCII)
_HALF = {"left": "L", "right": "R", "": ""}
# Units that move as one of the movements does, or are in parts.
_ALIKE = {"13": "34", "27": "26", "28": "28 lower, 28 upper"}


@dataclass(frozen=True, slots=True)
class Claim:
    """A movement of `usdface.facs.movements`, of both halves of the face or of one."""

    movement: str
    side: str = ""

    def __str__(self) -> str:
        number = self.movement.split()[0]
        unit = f"AU{self.movement}" if number[:2].rstrip("LR").isdigit() else self.movement
        return unit + self.side

    @property
    def title(self) -> str:
        """The movement in words."""
        half = {"L": ", left", "R": ", right"}.get(self.side, "")
        return MOVEMENTS[self.movement].title + half


def claims_of(names: Sequence[str]) -> Mapping[str, tuple[Claim, ...]]:
    """Return the movements that each name may claim; names that claim none are left out.

    >>> claims = claims_of(("mouthSmile_L", "jawLeft", "eyebrows-right-down", "AU12_R", "horns"))
    >>> [str(claim) for claim, in claims.values()]
    ['AU12L', 'AU30L', 'AU4R', 'AU12R']
    """
    found: dict[str, tuple[Claim, ...]] = {}
    for name, (base, side) in zip(names, shape_keys(names), strict=True):
        unit = _UNIT.fullmatch(base)
        if (base, side) in _DIRECTED:
            found[name] = (Claim(*_DIRECTED[base, side]),)
        elif base in _WHOLE_NAMES:
            found[name] = _of(_WHOLE_NAMES[base], _HALF[side])
        elif unit and unit[1] != base:
            number = _ALIKE.get(unit[1], unit[1])
            half = _HALF[side]
            found[name] = _of(number, half) or _of(number + half, "")
    return MappingProxyType({name: claims for name, claims in found.items() if claims})


def _of(movements: str, half: str) -> tuple[Claim, ...]:
    known = [movement for movement in movements.split(", ") if movement in MOVEMENTS]
    return tuple(Claim(name, half if MOVEMENTS[name].paired else "") for name in known)
