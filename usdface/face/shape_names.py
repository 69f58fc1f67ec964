"""Renaming of weights between naming conventions: ARKit, ICT, and their spellings."""

import re
import unicodedata

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.takes import WeightsTake

__all__ = ["DIRECTIONS", "rename_weights", "shape_key"]

# Left and right of these are directions, not sides.
DIRECTIONS = frozenset(("jaw", "mouth", "tongue", "head", "nose"))
_SIDES = {"l": "left", "r": "right", "left": "left", "right": "right"}
_ROUNDED = 1e-6  # of a weight
_NAMED = 6  # names that a message lists
# Letters of all scripts: those without a case, and accented ones, belong to the word around them.
_SMALL = r"[^\W\d_A-Z]"
_WORD = re.compile(rf"[A-Z]+(?!{_SMALL})|[A-Z]?{_SMALL}+|\d+")


def shape_key(name: str) -> tuple[str, str]:
    """Return a blend shape's name without its spelling: (name, "left", "right" or "").

    >>> shape_key("mouthSmile_L"), shape_key("MouthSmileLeft"), shape_key("mouthLeft")
    (('mouthsmile', 'left'), ('mouthsmile', 'left'), ('mouth', 'left'))

    The side may be the last word, the first, or one between:

    >>> shape_key("L_browDown"), shape_key("eyebrows-left-down")
    (('browdown', 'left'), ('eyebrowsdown', 'left'))
    """
    words = [word.lower() for word in _WORD.findall(unicodedata.normalize("NFC", name))]
    ends = [i for i in (len(words) - 1, 0) if words and words[i] in _SIDES]
    within = [i for i, word in enumerate(words) if word in ("left", "right")]
    if len(words) > 1 and (ends or within):
        at = (ends or within)[0]
        return "".join(words[:at] + words[at + 1 :]), _SIDES[words[at]]
    return "".join(words), ""


def rename_weights(take: WeightsTake, names: tuple[str, ...]) -> tuple[WeightsTake, list[Finding]]:
    """Map a weights take to the blend shapes of another rig, by name.

    A column goes to the shape of the same name, else of the same name in another spelling;
    one unsided curve drives both sides, two sided curves drive an unsided shape by their
    mean; of `DIRECTIONS` neither does. Weights are clipped to [0, 1].

    Returns
    -------
    WeightsTake
        Columns `names`; a blend shape without a curve is 0.
    list of Finding
        CHANNEL_IGNORED for curves without a blend shape.

    Raises
    ------
    InputError
        If no curve drives a blend shape.
    """
    exact = {name: i for i, name in enumerate(take.names)}
    by_key: dict[tuple[str, str], list[int]] = {}
    for i, name in enumerate(take.names):
        base, side = shape_key(name)
        by_key.setdefault((base, side), []).append(i)
        if base not in DIRECTIONS:
            by_key.setdefault((base, "either" if side else "both"), []).append(i)
    weights = np.zeros((len(take.times), len(names)))
    used: set[int] = set()
    for target, name in enumerate(names):
        base, side = shape_key(name)
        columns = [exact[name]] if name in exact else by_key.get((base, side), [])
        columns = columns or by_key.get((base, "both" if side else "either"), [])
        if columns:
            weights[:, target] = take.weights[:, columns].mean(axis=1)
            used.update(columns)
    if not used:
        raise InputError(
            f"no curve of the take {take.source} has the name of a blend shape of the rig, in any "
            f"spelling; curves: {_some(take.names)}; blend shapes: {_some(names)}; rename the "
            "rig's shapes like the curves (a phone's are ARKit's names), or use one that has them",
            "SHAPE_UNKNOWN",
        )
    findings = []
    idle = [name for i, name in enumerate(take.names) if i not in used]
    if idle:
        findings.append(
            finding(
                "CHANNEL_IGNORED", take.source, "curves without a blend shape: {channels}", idle
            )
        )
    outside = np.flatnonzero(((weights < -_ROUNDED) | (weights > 1.0 + _ROUNDED)).any(axis=0))
    if len(outside):
        shapes = [names[i] for i in outside]
        most = np.abs(weights - np.clip(weights, 0.0, 1.0)).max()
        message = "weights outside 0 to 1 were clipped, by {excess:.3g} at most: {shapes}"
        findings.append(finding("WEIGHTS_CLIPPED", take.source, message, most, shapes))
    renamed = WeightsTake(
        names,
        take.times,
        np.clip(weights, 0.0, 1.0),
        take.rate,
        take.start_timecode,
        take.source,
    )
    return renamed, findings


def _some(names: tuple[str, ...]) -> str:
    more = ", ..." if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more if names else "none"
