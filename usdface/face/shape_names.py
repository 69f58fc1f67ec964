"""Names of blend shapes in the spellings of ARKit, ICT and others."""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence

from usdface.face.shape_aliases import arkit_key, bare_name, sided

__all__ = [
    "DIRECTIONS",
    "SIDE_WORDS",
    "rig_keys",
    "shape_key",
    "spelling_key",
    "split_words",
    "whole_and_halves",
]

# Left and right of these are directions, not sides.
DIRECTIONS = frozenset(("jaw", "mouth", "tongue", "head", "nose"))
SIDE_WORDS = {
    **dict.fromkeys(("l", "lf", "lft", "left"), "left"),
    **dict.fromkeys(("r", "rt", "rgt", "right"), "right"),
}
# Letters of all scripts: those without a case, and accented ones, belong to the word around them.
_SMALL = r"[^\W\d_A-Z]"
_WORD = re.compile(rf"[A-Z]+(?!{_SMALL})|[A-Z]?{_SMALL}+|\d+")


def shape_key(name: str) -> tuple[str, str]:
    """Return the movement that a blend shape's name means: (name, "left", "right" or "").

    Of a rig, several may mean one movement; `spelling_key` tells these apart.

    >>> shape_key("mouthSmile_L"), shape_key("MouthSmileLeft"), shape_key("mouthLeft")
    (('mouthsmile', 'left'), ('mouthsmile', 'left'), ('mouth', 'left'))

    The side may be the last word, the first, or one between:

    >>> shape_key("L_browDown"), shape_key("eyebrows-left-down")
    (('browdown', 'left'), ('eyebrowsdown', 'left'))

    Prefixes by exporters do not count, and names of other programs for ARKit's are these:

    >>> shape_key("blendShape1.jawOpen"), shape_key("CTRL_expressions_mouthCornerPullL")
    (('jawopen', ''), ('mouthsmile', 'left'))
    """
    return arkit_key(*spelling_key(name))


def spelling_key(name: str) -> tuple[str, str]:
    """Return a blend shape's name without its spelling, its own one: no other program's.

    >>> spelling_key("Mouth_Funnel_Up_L"), spelling_key("CTRL_expressions_mouthFunnelUL")
    (('mouthfunnelup', 'left'), ('mouthfunnelu', 'left'))
    """
    return _key_of(bare_name(name))


def rig_keys(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the `spelling_key` of each of a rig's names; with their nodes where these differ.

    >>> rig_keys(("lid_bs.open_L", "lip_bs.open_L", "blendShape1.smile_L"))
    [('lidbsopen', 'left'), ('lipbsopen', 'left'), ('smile', 'left')]
    """
    keys = [spelling_key(name) for name in names]
    shared = {base for (base, _), count in Counter(keys).items() if count > 1}
    return [_key_of(n) if key[0] in shared else key for n, key in zip(names, keys, strict=True)]


def _key_of(name: str) -> tuple[str, str]:
    words = split_words(name)
    ends = [i for i in (len(words) - 1, 0) if words and words[i] in SIDE_WORDS]
    within = [i for i, word in enumerate(words) if word in ("left", "right")]
    if len(words) > 1 and (ends or within):
        at = (ends or within)[0]
        return sided("".join(words[:at] + words[at + 1 :]), SIDE_WORDS[words[at]])
    return sided("".join(words), "")


def split_words(name: str) -> list[str]:
    """Return the words of a name in lower case: at capitals, digits and anything between letters.

    >>> split_words("J_Adj_L_FaceEye"), split_words("eye.L.001")
    (['j', 'adj', 'l', 'face', 'eye'], ['eye', 'l', '001'])
    """
    return [word.lower() for word in _WORD.findall(unicodedata.normalize("NFC", name))]


def whole_and_halves(names: Iterable[str]) -> frozenset[str]:
    """Return the movements that a rig has both for the whole face and for each half of it.

    >>> whole_and_halves(("mouthSmile", "mouthSmileLeft", "mouthSmileRight", "jawOpen"))
    frozenset({'mouthsmile'})
    """
    keys = {shape_key(name) for name in names}
    return frozenset(b for b, side in keys if {(b, "left"), (b, "right")} <= keys and not side)
