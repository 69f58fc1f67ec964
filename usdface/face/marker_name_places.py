"""Places on a face by the names of markers: words, and their places on an average face."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from usdface.face.landmark_sets import landmark_places
from usdface.face.marker_name_words import SIDES, other_side, own_labels, words_of
from usdface.face.place_vocabulary import PARTS

__all__ = [
    "LANDMARKS",
    "NamedPlace",
    "named_places",
    "names_nose_tip",
]

# If at least this many names have a side, those without are on the midline.
_FEWEST_SIDED = 2

# The average face in millimetres: x from the midline to a side, y from the line of the eyes; after
# L. G. Farkas, "Anthropometry of the Head and Face", 1994 (eye corners 33 and 90 apart, mouth 52
# wide, nose as wide as the eyes are apart, eyes to lips 68, lips to chin 48).
LANDMARKS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "brow": (34.0, 23.0),
        "eye inner": (16.5, 0.0),
        "eye outer": (46.0, 0.0),
        "lid upper": (31.0, 5.5),
        "lid lower": (31.0, -5.5),
        "nose tip": (0.0, -36.0),
        "nose base": (0.0, -47.0),
        "mouth corner": (25.0, -68.0),
        "menton": (0.0, -116.0),
    }
)


@dataclass(frozen=True, slots=True)
class _Part:
    """The place of a part, the spread of markers with its name, and the steps of its directions.

    Lengths in mm on the average face; `steps` are those from (x, y).
    """

    x: float
    y: float
    spread: float
    steps: Mapping[str, tuple[float, float]] = field(default_factory=dict)


# Of one side.
_SIDED: dict[str, _Part] = {
    "forehead": _Part(
        *(38, 47, 14),
        {"upper": (-3, 14), "lower": (0, -12), "inner": (-18, 6), "outer": (15, -10)},
    ),
    "brow": _Part(
        *(34, 25, 10),
        {"upper": (0, 5), "lower": (0, -6), "inner": (-18, -1), "outer": (21, -7)},
    ),
    "lid": _Part(
        *(32, 0, 8),
        {"upper": (0, 6), "lower": (0, -6), "inner": (-13, 0), "outer": (12, 0)},
    ),
    "eye": _Part(
        *(32, 0, 9),
        {"upper": (0, 10), "lower": (0, -12), "inner": (-19, -4), "outer": (20, -2)},
    ),
    "temple": _Part(66, 10, 16, {"upper": (-3, 15), "lower": (0, -15)}),
    "ear": _Part(74, -12, 18),
    "cheekbone": _Part(
        *(56, -24, 14),
        {"upper": (0, 5), "lower": (0, -8), "inner": (-15, 0), "outer": (10, 0)},
    ),
    "cheek": _Part(
        *(50, -46, 16),
        {"upper": (1, 9), "lower": (4, -18), "inner": (-14, 0), "outer": (20, 3)},
    ),
    "nasolabial": _Part(28, -52, 10, {"upper": (-6, 10), "lower": (4, -12)}),
    "nostril": _Part(18, -40, 6, {"upper": (-2, 5), "lower": (-4, -5)}),
    "nose": _Part(20, -39, 9, {"upper": (-6, 24), "lower": (-2, -6)}),
    "lip": _Part(
        *(15, -68, 12),
        {"upper": (-1, 8), "lower": (-1, -8), "inner": (-6, 0), "outer": (9, 0)},
    ),
    "mouth": _Part(
        *(21, -68, 13),
        {"upper": (-3, 9), "lower": (-3, -10), "inner": (-6, 0), "outer": (7, 0)},
    ),
    "chin": _Part(
        *(38, -98, 20),
        {"upper": (-2, 8), "lower": (0, -8), "inner": (-12, -6), "outer": (12, 8)},
    ),
    "jaw": _Part(
        *(48, -86, 18),
        {"upper": (12, 22), "lower": (-10, -10), "inner": (-16, -12), "outer": (12, 20)},
    ),
}
# On the midline.
_CENTRAL: dict[str, _Part] = {
    "forehead": _Part(0, 55, 16, {"upper": (0, 12), "lower": (0, -15)}),
    "brow": _Part(0, 20, 8, {"upper": (0, 6), "lower": (0, -6)}),
    "nose": _Part(0, -30, 12, {"upper": (0, 28), "lower": (0, -12), "middle": (0, 10)}),
    "philtrum": _Part(0, -54, 6),
    "lip": _Part(0, -68, 12, {"upper": (0, 8), "lower": (0, -9)}),
    "mouth": _Part(0, -68, 13, {"upper": (0, 10), "lower": (0, -13)}),
    "chin": _Part(0, -104, 12, {"upper": (0, 9), "lower": (0, -10)}),
    "jaw": _Part(0, -106, 16),
}
# Where a direction that no step leads to changes the place: (x, y, spread).
_SIDED_POINTS: dict[tuple[str, str], tuple[float, float, float]] = {
    ("mouth", "corner"): (29, -69, 6),
    ("mouth", "end"): (29, -69, 6),
    ("lip", "corner"): (29, -69, 6),
    ("lip", "end"): (29, -69, 6),
    ("brow", "end"): (53, 18, 7),
    ("nose", "bridge"): (9, -6, 9),
    ("nose", "base"): (14, -44, 7),
    ("jaw", "corner"): (60, -70, 14),
}
_CENTRAL_POINTS: dict[tuple[str, str], tuple[float, float, float]] = {
    ("nose", "tip"): (0, -36, 5),
    ("nose", "head"): (0, -35, 6),
    ("nose", "bridge"): (0, -4, 10),
    ("nose", "base"): (0, -46, 6),
}
# Each direction that a name adds narrows the spread to this share.
_NARROWED = 0.7


@dataclass(frozen=True, slots=True)
class NamedPlace:
    """A place on the average face that a marker's name means.

    Attributes
    ----------
    part : str
        One of `usdface.face.place_vocabulary.PARTS`.
    side : int
        1 = left, -1 = right, 0 = not named, or the middle.
    places : tuple of (float, float)
        Where it can be [mm]: x to the performer's left, y up from the line of the eyes; more than
        one where the name leaves the side open.
    spread : float
        Standard deviation of markers with such a name [mm].
    """

    part: str
    side: int
    places: tuple[tuple[float, float], ...]
    spread: float

    @property
    def description(self) -> str:
        """The place in words, such as "left brow"."""
        return {1: "left ", -1: "right "}.get(self.side, "") + self.part


def named_places(names: Sequence[str]) -> tuple[NamedPlace | None, ...]:
    """Return the place that each name of a set means, None without a part of the face.

    Where other names have a side, one without is of the middle, unless there are several that
    only a number distinguishes. A first letter L or R is a side where the set has the same name
    with the other. Words without a place that all names begin or end with do not count. Numbered
    landmarks of a tracker have its places (`usdface.face.landmark_sets`).

    >>> left, right = named_places(("actor:LBrow_Outer_2", "Mundwinkel_rechts"))
    >>> left.part, left.side, right.places
    ('brow', 1, ((-29, -69),))
    >>> [place.description for place in named_places(("LOBRO", "ROBRO"))]
    ['left brow', 'right brow']
    """
    tracked = landmark_places(names)
    if tracked is not None:
        return tuple(
            NamedPlace(place.part, int(np.sign(place.x)), ((place.x, place.y),), place.spread)
            if place
            else None
            for place in tracked
        )
    own = own_labels(names)
    labels = {label.lower() for label in own}
    words = [words_of(label, sided=other_side(label) in labels) for label in own]
    alike = Counter(words)
    sides = sum(bool(each & SIDES.keys()) for each in words) >= _FEWEST_SIDED
    return tuple(_place(each, middle=sides and alike[each] == 1) for each in words)


def names_nose_tip(name: str) -> bool:
    """Whether a marker's name is that of the tip of the nose.

    >>> [names_nose_tip(name) for name in ("NoseHead", "Nasenspitze", "nose", "NoseHead_L")]
    [True, True, False, False]
    """
    words = words_of(name)
    return "nose" in words and bool(words & {"tip", "head"}) and not words & SIDES.keys()


def _place(words: frozenset[str], *, middle: bool) -> NamedPlace | None:
    parts = [part for part in PARTS if part in words]
    if not parts:
        return None
    side = sum(SIDES.get(word, 0) for word in words & set(SIDES))
    part = parts[0]
    if part == "lip" and words & {"corner", "end"}:
        part = "mouth"
    sided = _point(_SIDED, _SIDED_POINTS, part, words)
    central = _point(_CENTRAL, _CENTRAL_POINTS, part, words)
    if side and sided:
        x, y, spread = sided
        return NamedPlace(part, side, ((side * x, y),), spread)
    if central and (middle or not sided or words & {"middle", "tip", "bridge", "base"}):
        return NamedPlace(part, 0, (central[:2],), central[2])
    places = [central] if central else []
    if sided:
        places += [(sided[0], *sided[1:]), (-sided[0], *sided[1:])]
    return NamedPlace(
        part, 0, tuple((x, y) for x, y, _ in places), max(spread for _, _, spread in places)
    )


def _point(
    parts: Mapping[str, _Part],
    points: Mapping[tuple[str, str], tuple[float, float, float]],
    part: str,
    words: frozenset[str],
) -> tuple[float, float, float] | None:
    """Return (x, y, spread) of a part with the directions of `words`; None where it is not."""
    special = [points[part, word] for word in sorted(words) if (part, word) in points]
    base = parts.get(part)
    if special:
        return special[0]
    if base is None:
        return None
    known = [base.steps[word] for word in sorted(words & base.steps.keys())]
    x = base.x + sum(step[0] for step in known)
    y = base.y + sum(step[1] for step in known)
    directions = len(known) + (1 if "middle" in words and "middle" not in base.steps else 0)
    return x, y, base.spread * _NARROWED ** min(directions, 2)
