"""Renaming of weights between naming conventions: ARKit, ICT, and their spellings."""

import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.errors import InputError, did_you_mean
from usdface.finding_values import Prose
from usdface.findings import Finding, finding
from usdface.takes import WeightsTake

__all__ = ["DIRECTIONS", "curves_without_name", "rename_weights", "shape_key"]

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


def rename_weights(
    take: WeightsTake,
    names: tuple[str, ...],
    curves: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[WeightsTake, list[Finding]]:
    """Map a weights take to the blend shapes of another rig, by name or as told.

    A column goes to the shape of the same name, else of the same name in another spelling;
    one unsided curve drives both sides, two sided curves drive an unsided shape by their
    mean; of `DIRECTIONS` neither does. Weights are clipped to [0, 1].

    Parameters
    ----------
    take : WeightsTake
    names : tuple of str
        The rig's blend shapes.
    curves : mapping of str to mapping of str to float, optional
        The blend shapes that a curve drives, with factors. Names decide neither for these curves
        nor for these blend shapes, which are sums.

    Returns
    -------
    WeightsTake
        Columns `names`; a blend shape without a curve is 0.
    list of Finding
        CHANNEL_IGNORED for curves without a blend shape, CURVE_UNKNOWN for those of `curves` that
        the take lacks, WEIGHTS_CLIPPED.

    Raises
    ------
    InputError
        If no curve drives a blend shape, or `curves` names one that the rig lacks.
    """
    told, findings = _told(take, names, curves or {})
    row = {name: i for i, name in enumerate(take.names)}
    place = {name: i for i, name in enumerate(names)}
    idle = [i for i, name in enumerate(take.names) if name not in told]
    driven = {shape for shapes in told.values() for shape in shapes}
    by_name = _by_name(take.names, idle, [name for name in names if name not in driven])
    factors = np.zeros((len(take.names), len(names)))
    for name, columns in by_name.items():
        factors[columns, place[name]] = 1.0 / len(columns)
    for curve, shapes in told.items():
        for name, factor in shapes.items():
            factors[row[curve], place[name]] = factor
    if not factors.any():
        first = {"curves": {take.names[0]: {(*names, "a blend shape")[0]: 1.0}}}
        example = json.dumps(first, ensure_ascii=False)
        raise InputError(
            f"no curve of the take {take.source} has the name of a blend shape of the rig, in any "
            f"spelling; curves: {_some(take.names)}; blend shapes: {_some(names)}; "
            f"say which drives which in --bind bind.json, as {example}",
            "SHAPE_UNKNOWN",
        )
    unused = [take.names[i] for i in idle if not factors[i].any()]
    if unused:
        message = "curves without a blend shape: {channels}"
        findings.append(finding("CHANNEL_IGNORED", take.source, message, unused))
    weights = take.weights @ factors
    outside = np.flatnonzero(((weights < -_ROUNDED) | (weights > 1.0 + _ROUNDED)).any(axis=0))
    if len(outside):
        clipped = [names[i] for i in outside]
        most = np.abs(weights - np.clip(weights, 0.0, 1.0)).max()
        message = "weights outside 0 to 1 were clipped, by {excess:.3g} at most: {shapes}"
        findings.append(finding("WEIGHTS_CLIPPED", take.source, message, most, clipped))
    return replace(take, names=names, weights=np.clip(weights, 0.0, 1.0)), findings


def curves_without_name(curves: tuple[str, ...], shapes: tuple[str, ...]) -> tuple[str, ...]:
    """Return the curves that drive no blend shape by their names, as `rename_weights` has it."""
    by_name = _by_name(curves, range(len(curves)), shapes)
    used = {column for columns in by_name.values() for column in columns}
    return tuple(name for i, name in enumerate(curves) if i not in used)


def _told(
    take: WeightsTake, names: tuple[str, ...], curves: Mapping[str, Mapping[str, float]]
) -> tuple[dict[str, Mapping[str, float]], list[Finding]]:
    """Return the entries of `curves` that the take has, by its own spelling; report the others."""
    spelt = {shape_key(name): name for name in reversed(take.names)}
    of_take, of_rig = set(take.names), set(names)
    told: dict[str, Mapping[str, float]] = {}
    findings = []
    for curve, shapes in curves.items():
        for name in shapes:
            if name not in of_rig:
                raise InputError(
                    f"the curve {curve!r} of the binding drives {name!r}, a blend shape the rig "
                    f"has not{did_you_mean(name, names)}",
                    "SHAPE_UNKNOWN",
                )
        own = curve if curve in of_take else spelt.get(shape_key(curve))
        if own is None:
            hint = Prose(did_you_mean(curve, take.names))
            message = "the binding names the curve {curve!r}, which the take has not{hint}"
            findings.append(finding("CURVE_UNKNOWN", take.source, message, curve, hint))
        else:
            told[own] = shapes
    return told, findings


def _by_name(
    curves: tuple[str, ...], idle: Sequence[int], shapes: Sequence[str]
) -> dict[str, list[int]]:
    """Return the `idle` ones of the curves that drive each blend shape by their names."""
    exact = {curves[i]: i for i in idle}
    by_key: dict[tuple[str, str], list[int]] = {}
    for i in idle:
        base, side = shape_key(curves[i])
        by_key.setdefault((base, side), []).append(i)
        if base not in DIRECTIONS:
            by_key.setdefault((base, "either" if side else "both"), []).append(i)
    found = {}
    for name in shapes:
        base, side = shape_key(name)
        columns = [exact[name]] if name in exact else by_key.get((base, side), [])
        columns = columns or by_key.get((base, "both" if side else "either"), [])
        if columns:
            found[name] = columns
    return found


def _some(names: tuple[str, ...]) -> str:
    more = ", ..." if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more if names else "none"
