"""Names of ARKit's blend shapes in other programs, and what exporters put before a name.

Of names that mean the same movement; those that only come near are naming conventions
(`usdface.face.facs_names`). Sources: the morph lists of Character Creator 4 (ExPlus, and the ARKit
profile ``A38_Mouth_Smile_Left``) and of Daz Genesis 8.1 and 9 (``facs_bs_MouthSmileLeft_div2``),
the curves of Epic's MetaHuman (``CTRL_expressions_mouthCornerPullL``), exports of VRoid
(``Face.M_F00_000_00_Fcl_MTH_A``).
"""

import re

__all__ = ["arkit_key", "bare_name"]

# What exporters put before a blend shape's name: the figure and the kind of the control.
_BEFORE = re.compile(
    r".*?(?:(?<![A-Za-z])eCTRL|(?<![A-Za-z])facs_(?:bs|ctrl|jnt)_|CTRL_expressions_|(?=Fcl_))"
    r"|\w*?[Bb]lend_?[Ss]hapes?\d*_"  # a node, where the dot behind it is not allowed: USD's prims
    r"|A\d\d_(?=[A-Z])"
)
_AFTER = re.compile(r"_div\d$")  # Daz: the level of subdivision
# Namespaces and paths before a name, and nodes as of Maya: ``rig:head_bs.smile``. Other dots part
# the words of a name (``eye.blink.L``).
_NODE = re.compile(r"(?i:blend|shape|morph|target)|(?<![A-Za-z])bs(?![A-Za-z])|BS")
_OF_NAME = re.compile(r"(?i:l|r|left|right|\d*)")  # a side, or the number of a copy

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
    """Return a blend shape's name without what an exporter put before and behind it.

    >>> bare_name("blendShape1.smile_L"), bare_name("smile.L")
    ('smile_L', 'smile.L')
    >>> bare_name("Genesis9__facs_bs_JawOpen_div2")
    'JawOpen'
    """
    own = name[max(name.rfind(":", 0, -1), name.rfind("|", 0, -1)) + 1 :]
    node, _, rest = own.partition(".")
    own = rest if _NODE.search(node) and not _OF_NAME.fullmatch(rest) else own
    before = _BEFORE.match(own)
    own = own[before.end() :] if before and before.end() < len(own) else own
    return _AFTER.sub("", own)


def arkit_key(base: str, side: str) -> _Key:
    """Return the name and side that ARKit has for a movement; the same ones if it has no other.

    >>> arkit_key("browdrop", "left"), arkit_key("eyerlook", "left"), arkit_key("mouthpressdl", "")
    (('browdown', 'left'), ('eyelookin', 'right'), ('mouthpress', 'left'))
    """
    if (base, side) in _WHOLE:
        return _WHOLE[base, side]
    if not side and base[:-1] in _QUARTERS and base[-1] in _SIDES:
        return _QUARTERS[base[:-1]], _SIDES[base[-1]]
    return _SAME.get(base, base), side
