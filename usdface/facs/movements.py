"""Movements of feature points for each facial action unit, as data.

The signs are those of the appearance changes in P. Ekman, W. Friesen, J. Hager, "Facial Action
Coding System", 2002, in our words and as lengths: how far each feature point goes, in tenths of the
way of the one that goes farthest. The lengths are rough, because faces differ: a shape is compared
with all movements by the angle between them (`usdface.facs.judge`), never by a length alone.

A line is ``point: direction tenths ...``. `out` and `in` lead from and to the midline,
`left` and `right` are the character's, `up`, `down`, `forward`, `back` those of the head. Points of
`SIDED` are of both halves; a movement of one half (``AU12L``) has those of its half and all of the
middle.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["CENTRAL", "MOVEMENTS", "POINTS", "SIDED", "Movement", "prototype"]

SIDED = (
    *("inner brow", "middle brow", "outer brow", "upper lid", "lower lid", "eyeball"),
    *("upper cheek", "cheek", "lower cheek", "nasolabial fold"),
    *("nose bridge", "nose side", "nose wing"),
    *("lip corner", "upper lip", "lower lip", "jaw"),
)
CENTRAL = (
    *("glabella", "nose root", "nose tip", "philtrum", "middle upper lip", "middle lower lip"),
    *("lip groove", "chin boss", "chin"),
)
# All feature points, by name: those of the left, of the right, of the middle.
POINTS = (*(f"left {p}" for p in SIDED), *(f"right {p}" for p in SIDED), *CENTRAL)

_DIRECTIONS = {
    "out": (1, 0, 0),
    "in": (-1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "forward": (0, 0, 1),
    "back": (0, 0, -1),
}
_ABSOLUTE = {"left": 1, "right": -1}


@dataclass(frozen=True, slots=True)
class Movement:
    """The movement of an action unit, or of a part of one that rigs have blend shapes for.

    Attributes
    ----------
    name : str
        Key of `MOVEMENTS`: number of the unit, maybe with the part.
    title : str
    paired : bool
        Each half of the face can do it alone.
    ways : mapping of str to (3,) tuple of float
        Outwards, up and forward, of each feature point; 1 = the longest way.
    turned : frozenset of str
        Points whose first number is to the character's left on both halves.
    """

    name: str
    title: str
    paired: bool
    ways: Mapping[str, tuple[float, float, float]]
    turned: frozenset[str] = frozenset()


# Units that each half of the face can do alone.
_PAIRED = """
1 = inner brow raiser
    inner brow: up 10
    middle brow: up 4
    glabella: up 3
2 = outer brow raiser
    outer brow: up 7
    middle brow: up 10
    inner brow: up 4
4 = brow lowerer
    inner brow: in 5 down 10 forward 3
    middle brow: in 4 down 7 forward 3
    outer brow: in 2 down 3 forward 1
    glabella: down 2
5 = upper lid raiser
    upper lid: up 10 back 5
6 = cheek raiser
    upper cheek: up 10 forward 5
    cheek: up 8 forward 4
    lower lid: up 4 forward 1
    lower cheek: up 3
7 = lid tightener
    lower lid: up 10 forward 3
    upper lid: down 4
    upper cheek: up 4
9 = nose wrinkler
    nose wing: up 10
    nasolabial fold: up 8
    nose side: up 5
    upper lip: up 8
    middle upper lip: up 4
    philtrum: up 4
    upper cheek: up 4
    inner brow: in 2 down 5
10 = upper lip raiser
    upper lip: up 10
    middle upper lip: up 6
    philtrum: up 5
    nasolabial fold: up 7
    nose wing: up 4
    lip corner: up 3
    cheek: up 3
    upper cheek: up 2
12 = lip corner puller
    lip corner: out 8 up 10 back 8
    upper lip: out 4 up 4 back 4
    lower lip: out 4 up 3 back 3
    nasolabial fold: out 4 up 5 back 3
    lower cheek: out 4 up 5 back 2
    cheek: out 3 up 4 forward 2
    upper cheek: out 1 up 3 forward 2
14 = dimpler
    lip corner: out 6 up 2 back 10
    upper lip: out 3 back 3
    lower lip: out 3 back 3
    nasolabial fold: out 3
15 = lip corner depressor
    lip corner: out 4 down 10 back 3
    upper lip: out 1 down 3 back 1
    lower lip: out 1 down 2
    nasolabial fold: down 4
    lower cheek: down 3
16 = lower lip depressor
    lower lip: down 10
    middle lower lip: down 7
    lip groove: down 6
    chin boss: down 3
    lip corner: down 2
20 = lip stretcher
    lip corner: out 10 down 3 back 8
    upper lip: out 5 down 1 back 4
    lower lip: out 5 down 2 back 3
    nasolabial fold: out 3 down 1 back 2
    lower cheek: out 3 back 1
23 = lip tightener
    upper lip: out 3 down 3 back 9
    lower lip: out 3 up 4 back 9
    lip corner: out 6 up 3 back 7
    middle upper lip: down 2 back 3
    middle lower lip: up 2 back 3
24 = lip pressor
    lower lip: up 8
    middle lower lip: up 5
    upper lip: down 3
    middle upper lip: down 2
    lip corner: up 6
    lip groove: up 6
    chin boss: up 6
    chin: up 4
    jaw: up 8 forward 4
    nasolabial fold: forward 4
34 = cheek puff
    lower cheek: out 7 forward 10
    cheek: out 4 up 1 forward 5
    nasolabial fold: out 1 forward 6
    lip corner: forward 5
    upper lip: forward 3
    lower lip: forward 3
38 = nostril dilator
    nose wing: out 10
39 = nostril compressor
    nose wing: in 10
    nose side: in 3
43 = eyes closed
    upper lid: down 10
    lower lid: up 3
61 = eye turns left
    eyeball: left 10
    upper lid: left 3
    lower lid: left 3
62 = eye turns right
    eyeball: right 10
    upper lid: right 3
    lower lid: right 3
63 = eye turns up
    eyeball: up 10
    upper lid: up 5 back 2
    lower lid: up 2
64 = eye turns down
    eyeball: down 10
    upper lid: down 6
    lower lid: down 2
"""
# Units of the whole face, and parts of them that rigs have blend shapes for.
_WHOLE = """
9 root = nose wrinkler, root of the nose
    nose root: down 10
    nose bridge: up 10
    glabella: down 3
8 = lips toward each other
    lower lip: up 10 forward 6
    middle lower lip: up 10 forward 6
    lip groove: up 5 forward 3
    upper lip: down 3
    middle upper lip: down 3
    lip corner: up 3 forward 1
17 = chin raiser
    chin boss: up 10 forward 4
    lip groove: up 10 forward 5
    middle lower lip: up 9 forward 6
    lower lip: up 8 forward 6
    chin: up 5 forward 3
    jaw: up 4 forward 2
    lip corner: up 2 forward 2
    middle upper lip: up 2 forward 2
17 upper = chin raiser, upper lip
    middle upper lip: up 10 forward 4
    upper lip: up 9 forward 4
    philtrum: up 8 forward 2
    middle lower lip: up 4 forward 2
    lower lip: up 4 forward 2
18 = lip pucker
    lip corner: in 8 forward 10
    upper lip: in 4 forward 9
    lower lip: in 4 forward 9
    middle upper lip: forward 8
    middle lower lip: forward 8
    philtrum: forward 6
    lip groove: forward 4
22 = lip funneler
    lip corner: in 5 forward 8
    upper lip: in 3 up 4 forward 8
    lower lip: in 3 down 7 forward 9
    middle upper lip: up 6 forward 7
    middle lower lip: down 9 forward 7
    philtrum: up 5 forward 6
    lip groove: down 4 forward 5
22 lower = lip funneler, lower lip
    middle lower lip: up 4 forward 10
    lower lip: up 4 forward 7
    lip groove: up 2 forward 3
25 = lips part
    middle upper lip: up 7
    upper lip: up 5
    philtrum: up 5
    middle lower lip: down 10
    lower lip: down 8
    lip groove: down 4
26 = jaw drop
    chin: down 8 back 9
    chin boss: down 9 back 9
    lip groove: down 10 back 9
    middle lower lip: down 10 back 7
    lower lip: down 10 back 7
    jaw: down 6 back 8
    lip corner: in 1 down 4 back 3
    lower cheek: down 3 back 3
28 upper = lip suck, upper lip
    middle upper lip: back 10
    upper lip: back 9
    philtrum: down 2 back 2
28 lower = lip suck, lower lip
    middle lower lip: up 4 back 10
    lower lip: up 3 back 9
    lip groove: up 3
29 = jaw thrust
    chin: forward 10
    chin boss: forward 10
    lip groove: forward 10
    middle lower lip: forward 10
    lower lip: forward 10
    jaw: forward 10
    lip corner: forward 4
    lower cheek: forward 3
30L = jaw sideways, left
    chin: left 10
    chin boss: left 10
    lip groove: left 10
    middle lower lip: left 10
    lower lip: left 10
    jaw: left 10
    lip corner: left 5
    lower cheek: left 4
30R = jaw sideways, right
    chin: right 10
    chin boss: right 10
    lip groove: right 10
    middle lower lip: right 10
    lower lip: right 10
    jaw: right 10
    lip corner: right 5
    lower cheek: right 4
mouth left = mouth to the left
    lip corner: left 10
    upper lip: left 10
    lower lip: left 10
    middle upper lip: left 10
    middle lower lip: left 10
    philtrum: left 8
    lip groove: left 6
    lower cheek: left 4
    nasolabial fold: left 3
mouth right = mouth to the right
    lip corner: right 10
    upper lip: right 10
    lower lip: right 10
    middle upper lip: right 10
    middle lower lip: right 10
    philtrum: right 8
    lip groove: right 6
    lower cheek: right 4
    nasolabial fold: right 3
"""


def _movements(text: str, paired: bool) -> dict[str, Movement]:
    """Read a table: a line ``name = title``, then one for each point, set in."""
    found: dict[str, Movement] = {}
    for block in re.split(r"\n(?=\S)", text.strip()):
        head, *lines = block.splitlines()
        name, _, title = head.partition(" = ")
        ways: dict[str, tuple[float, float, float]] = {}
        turned = set()
        for line in lines:
            point, _, words = line.strip().partition(": ")
            way = np.zeros(3)
            for direction, tenths in re.findall(r"([a-z]+) (\d+)", words):
                if direction in _ABSOLUTE:
                    way[0] += _ABSOLUTE[direction] * int(tenths) / 10
                    turned.add(point)
                else:
                    way += np.multiply(_DIRECTIONS[direction], int(tenths) / 10)
            ways[point] = (float(way[0]), float(way[1]), float(way[2]))
        found[name] = Movement(name, title, paired, MappingProxyType(ways), frozenset(turned))
    return found


MOVEMENTS: Mapping[str, Movement] = MappingProxyType(
    _movements(_PAIRED, paired=True) | _movements(_WHOLE, paired=False)
)


def prototype(movement: Movement, side: str) -> FloatArray:
    """Return the ways of all feature points in a movement: (len(POINTS), 3), left, up, forward.

    Parameters
    ----------
    movement : Movement
    side : {"L", "R", ""}
        The half that does it; "" = both.
    """
    result = np.zeros((len(POINTS), 3))
    for point, way in movement.ways.items():
        if point in CENTRAL:
            result[POINTS.index(point)] = way
            continue
        for half, sign in (("left", 1.0), ("right", -1.0)):
            if side in ("", half[0].upper()):
                across = 1.0 if point in movement.turned else sign
                result[POINTS.index(f"{half} {point}")] = np.multiply(way, (across, 1, 1))
    return result
