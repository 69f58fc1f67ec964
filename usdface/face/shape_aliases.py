"""Names of ARKit's blend shapes in other programs, and prefixes by exporters.

Of names that mean the same movement; those that only come near are naming conventions
(`usdface.face.facs_names`). Sources: the morph lists of Character Creator 4 (ExPlus, and the ARKit
profile ``A38_Mouth_Smile_Left``) and of Daz Genesis 8.1 and 9 (``facs_bs_MouthSmileLeft_div2``),
the curves of Epic's MetaHuman (``CTRL_expressions_mouthCornerPullL``), exports of VRoid
(``Face.M_F00_000_00_Fcl_MTH_A``).
"""

import re

__all__ = ["arkit_key", "bare_name", "is_counted", "sided"]

# Prefixes by exporters: the figure and the kind of the control.
_BEFORE = re.compile(
    r".*?(?:(?<![A-Za-z])eCTRL|(?<![A-Za-z])facs_(?:bs|ctrl|jnt)_|CTRL_expressions_|(?=Fcl_))"
    r"|\w*?[Bb]lend_?[Ss]hapes?\d*_"  # a node, where the dot behind it is not allowed: USD's prims
    r"|A\d\d_(?=[A-Z])"
)
_AFTER = re.compile(r"_div\d$")  # Daz: the level of subdivision
# Nodes as of Maya, before a dot: ``head_bs``. Other dots part the words of a name: ``eye.blink.L``.
_NODE = re.compile(r"\w*[Bb]lend_?[Ss]hapes?\d*|(?:\w*_)?(?:bs|BS)\d*|\w*[a-z\d]BS\d*")
_WORD = re.compile(r"[^\W\d_A-Z]{2,}|[A-Z](?:[^\W\d_A-Z]+|[A-Z]+)")  # of two letters and more
_SIDE_WORDS = ("left", "right")

_Key = tuple[str, str]

_SAME = {
    # Character Creator
    "browdrop": "browdown",
    "browraiseinner": "browinnerup",
    "browraiseouter": "browouterup",
    "cheekraise": "cheeksquint",
    "mouthdownlower": "mouthlowerdown",
    "mouthfunneldown": "mouthfunnel",
    "mouthfunnelup": "mouthfunnel",
    "mouthpuckerdown": "mouthpucker",
    "mouthpuckerup": "mouthpucker",
    "mouthrollinlower": "mouthrolllower",
    "mouthrollinupper": "mouthrollupper",
    "mouthupupper": "mouthupperup",
    # MetaHuman
    "browraisein": "browinnerup",
    "eyecheekraise": "cheeksquint",
    "eyesquintinner": "eyesquint",
    "eyewiden": "eyewide",
    "jawfwd": "jawforward",
    "mouthcheekblow": "cheekpuff",
    "mouthcornerdepress": "mouthfrown",
    "mouthcornerpull": "mouthsmile",
    "mouthlowerlipdepress": "mouthlowerdown",
    "mouthlowerliprollin": "mouthrolllower",
    "mouthupperlipraise": "mouthupperup",
    "mouthupperliprollin": "mouthrollupper",
    "nosewrinkle": "nosesneer",
}
# Where the side is not the last word, or means a direction of the eyes.
_WHOLE: dict[_Key, _Key] = {
    ("eyellookup", ""): ("eyelookup", "left"),
    ("eyerlookup", ""): ("eyelookup", "right"),
    ("eyellookdown", ""): ("eyelookdown", "left"),
    ("eyerlookdown", ""): ("eyelookdown", "right"),
    ("eyellook", "left"): ("eyelookout", "left"),
    ("eyellook", "right"): ("eyelookin", "left"),
    ("eyerlook", "left"): ("eyelookin", "right"),
    ("eyerlook", "right"): ("eyelookout", "right"),
    ("eyelookleft", "left"): ("eyelookout", "left"),
    ("eyelookright", "left"): ("eyelookin", "left"),
    ("eyelookleft", "right"): ("eyelookin", "right"),
    ("eyelookright", "right"): ("eyelookout", "right"),
}
# MetaHuman has a quarter of the lips each: ``mouthFunnelUL`` is up, left.
_QUARTERS = {
    "jawchinraised": "mouthshruglower",
    "jawchinraiseu": "mouthshrugupper",
    **{f"mouthfunnel{end}": "mouthfunnel" for end in "ud"},
    **{f"mouthlipspurse{end}": "mouthpucker" for end in "ud"},
    **{f"mouthpress{end}": "mouthpress" for end in "ud"},
}
_SIDES = {"l": "left", "r": "right"}


def bare_name(name: str) -> str:
    """Return a blend shape's name without an exporter's prefix and suffix.

    >>> bare_name("blendShape1.smile_L"), bare_name("smile.L")
    ('smile_L', 'smile.L')
    >>> bare_name("Genesis9__facs_bs_JawOpen_div2")
    'JawOpen'
    """
    own = name
    last = name[max(name.rfind(":"), name.rfind("|")) + 1 :]  # behind a namespace or a path
    node, _, rest = last.partition(".")
    if _NODE.fullmatch(node) and _words(rest):
        own = rest
    elif _words(last) > 1:  # one word needs the one before it: ``Eyes:Closed``
        own = last
    before = _BEFORE.match(own)
    own = own[before.end() :] if before and _words(own[before.end() :]) else own
    return _AFTER.sub("", own)


def is_counted(name: str, own: str) -> bool:
    """Return whether an exporter made a name unique by a number behind a blend shape's own one.

    Blender's does so over all meshes of a skeleton, in the order of their names: ``jawOpen`` of
    the brows, ``jawOpen2`` of the head. The prims of the blend shapes keep their own names.

    >>> is_counted("jawOpen2", "jawOpen"), is_counted("jawOpen", "jawOpen")
    (True, False)
    """
    return bool(own) and name.startswith(own) and name[len(own) :].isdecimal()


def _words(name: str) -> int:
    """Return how many words a name has that are neither letters alone, numbers nor sides."""
    return sum(word.lower() not in _SIDE_WORDS for word in _WORD.findall(name))


def sided(base: str, side: str) -> _Key:
    """Return a name and its side where programs write the side in a way of their own.

    >>> sided("eyerlook", "left"), sided("mouthpressdl", "")
    (('eyelookin', 'right'), ('mouthpressd', 'left'))
    """
    if not side and base[:-1] in _QUARTERS and base[-1] in _SIDES:
        return base[:-1], _SIDES[base[-1]]
    return _WHOLE.get((base, side), (base, side))


def arkit_key(base: str, side: str) -> _Key:
    """Return the name and side that ARKit has for a movement; the same ones if it has no other.

    Several shapes of a rig may be one movement: both quarters of a side of the lips.

    >>> arkit_key("browdrop", "left"), arkit_key("mouthpressd", "left")
    (('browdown', 'left'), ('mouthpress', 'left'))
    """
    return _SAME.get(base, _QUARTERS.get(base, base) if side else base), side
