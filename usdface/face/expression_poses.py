"""Expression poses for rigs with known blend shape names.

Two tables and their product. `EMOTIONS` has the facial action units of each emotion and their
strengths: the emotion prototypes of FACS, as in P. Ekman, W. Friesen, J. Hager, "Facial Action
Coding System: Investigator's Guide", 2002 (EMFACS: joy 6 + 12, sadness 1 + 4 + 15, anger
4 + 5 + 7 + 23, fear 1 + 2 + 4 + 5 + 7 + 20 + 26, disgust 9 + 15 + 16, surprise 1 + 2 + 5B + 26;
the letter B is a slight intensity). `usdface.face.facs_names` has the blend shapes of each action
unit in each naming convention. Strengths are chosen so that the poses look right and differ
clearly. A rig with blend shapes named after the emotions needs neither table. Other emotions
are data: poses of blend shapes or of action units, from a file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from types import MappingProxyType

import numpy as np

from usdface.errors import InputError
from usdface.face.emotion_names import EMOTION_NAMES
from usdface.face.facs_names import NAMING_CONVENTIONS, ActionUnit, NamingConvention
from usdface.face.plain_names import plain_names, shape_keys
from usdface.face.shape_names import shape_key, spelling_key
from usdface.findings import Finding, finding
from usdface.frozen_mapping import FrozenMapping
from usdface.setup.expression import Expression

__all__ = ["EMOTIONS", "ActionPose", "composed_pose", "expressions_for", "units_of"]


@dataclass(frozen=True, slots=True)
class ActionPose:
    """An expression as action units, which any rig with a known naming convention can show.

    `units` has the strength of each, in [0, 1].
    """

    name: str
    units: Mapping[ActionUnit, float]
    gain: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", FrozenMapping(self.units))
        for unit, strength in self.units.items():
            if not 0 <= strength <= 1:
                raise InputError(
                    f"expression {self.name!r}: {unit} is {strength:g}; expected 0 to 1"
                )


EMOTIONS: dict[str, dict[int, float]] = {
    "joy": {6: 0.8, 12: 0.9},
    "sadness": {1: 1.0, 4: 0.4, 15: 0.9, 17: 0.4},
    "anger": {4: 1.0, 5: 0.6, 7: 0.7, 23: 0.9},
    "fear": {1: 0.9, 2: 0.6, 4: 0.4, 5: 1.0, 7: 0.2, 20: 1.0, 26: 0.25},
    "disgust": {9: 1.0, 15: 0.4, 16: 0.5},
    "surprise": {1: 1.0, 2: 1.0, 5: 0.6, 26: 0.7},
}


def expressions_for(
    shape_names: Sequence[str],
    given: Mapping[str, Expression | ActionPose | None] = MappingProxyType({}),
) -> tuple[tuple[Expression, ...], list[Finding]]:
    """Return the expression poses of a rig.

    Poses that are `given` go first. A shape named after the emotion (`EMOTION_NAMES`; of several
    the first there) is the pose; otherwise it is composed of action units, in the naming
    convention of most of the rig's names. Names are read in any spelling, as
    `usdface.face.shape_names` does, and without a prefix or suffix of all (`plain_names`).

    Parameters
    ----------
    shape_names : sequence of str
        Blend shapes of the rig.
    given : mapping of str to Expression, ActionPose or None
        Poses by name, of any emotion; None leaves one of `EMOTIONS` out.

    Returns
    -------
    expressions : tuple of Expression
        In the order of `EMOTIONS`, then of `given`; without those for which the rig has too few
        shapes.
    findings : list of Finding
        EXPRESSION_UNKNOWN for each that is left out, SHAPE_UNKNOWN for each without some of its
        units or blend shapes.
    """
    shapes = _known_shapes(tuple(shape_names))
    spelt: dict[tuple[str, str], list[str]] = {}
    names = sorted(shape_names)
    for name, key in zip(names, shape_keys(names), strict=True):
        spelt.setdefault(key, []).append(name)
    expressions, findings = [], []
    for emotion in EMOTION_NAMES:
        named = [name for word in EMOTION_NAMES[emotion] for name in spelt.get((word, ""), ())]
        if emotion in given or not (named or emotion in EMOTIONS):
            continue
        if named:
            expressions.append(Expression(emotion, (named[0],), np.ones(1)))
            continue
        units = {ActionUnit(unit): strength for unit, strength in EMOTIONS[emotion].items()}
        shown, new_findings = _composed(ActionPose(emotion, units), shapes)
        expressions += shown
        findings += new_findings
    for pose in given.values():
        if isinstance(pose, ActionPose):
            shown, new_findings = _composed(pose, shapes)
            expressions += shown
            findings += new_findings
        elif pose is not None:
            expressions.append(pose)
            findings += [
                finding(
                    "SHAPE_UNKNOWN",
                    shape,
                    "it is named in the expression {expression!r}",
                    pose.name,
                )
                for shape in sorted(set(pose.shapes) - set(shape_names))
            ]
    return tuple(expressions), findings


def units_of(shape_names: Sequence[str]) -> Mapping[str, frozenset[int]]:
    """Return the action units of each blend shape; blend shapes without any are left out.

    In the naming convention of most of the names, in any spelling.
    """
    return _units_of(tuple(shape_names))


@lru_cache(maxsize=8)
def _units_of(shape_names: tuple[str, ...]) -> Mapping[str, frozenset[int]]:
    shapes = _known_shapes(shape_names)
    units: dict[str, set[int]] = {}
    for unit in shapes.convention.units:
        for name, _ in shapes.of_unit(ActionUnit(unit)):
            units.setdefault(name, set()).add(unit)
    return MappingProxyType({name: frozenset(own) for name, own in units.items()})


def composed_pose(units: Mapping[int, float], shape_names: Sequence[str]) -> Expression | None:
    """Return action units with their strengths as a pose; None where a rig lacks half of them."""
    pose = ActionPose("units", {ActionUnit(unit): share for unit, share in units.items()})
    made, _ = _composed(pose, _known_shapes(tuple(shape_names)))
    return made[0] if made else None


@dataclass(frozen=True, eq=False, slots=True)
class _KnownShapes:
    """The blend shapes of a rig that a naming convention knows.

    `spelt` has the rig's own names for each name of the convention that it has: several where
    the rig has a movement in parts.
    """

    convention: NamingConvention
    spelt: Mapping[str, tuple[str, ...]]

    def of_unit(self, unit: ActionUnit) -> list[tuple[str, float]]:
        """Return the rig's blend shapes of a unit, with their weights."""
        named = self.convention.names(unit)
        return [(own, weight) for name, weight in named for own in self.spelt.get(name, ())]


@lru_cache(maxsize=8)
def _known_shapes(shape_names: tuple[str, ...]) -> _KnownShapes:
    """Return the blend shapes of the naming convention of most of the names."""
    found = (
        _KnownShapes(convention, _spelt(keys, shape_names))
        for convention, keys in zip(NAMING_CONVENTIONS, _convention_keys(), strict=True)
    )
    return max(
        found, key=lambda shapes: len({name for own in shapes.spelt.values() for name in own})
    )


def _spelt(
    keys: Mapping[str, tuple[str, str]], shape_names: Sequence[str]
) -> dict[str, tuple[str, ...]]:
    """Return the rig's names for each name of a convention that it has in any spelling.

    Of a rig with several spellings of one name, those of the convention count, as artists mean
    these; without any, the first by the alphabet, so that a pose does not move the skin twice.
    Names of other programs count without any of these, and all of them: they are parts of one
    movement, as the upper and the lower lip's.
    """
    plain = plain_names(shape_names)
    own: dict[tuple[str, str], str] = {}
    for name in sorted(shape_names, key=lambda name: (name not in keys, name)):
        own.setdefault(spelling_key(plain[name]), name)
    parts: dict[tuple[str, str], tuple[str, ...]] = {}
    for name in own.values():
        key = shape_key(plain[name])
        parts[key] = (*parts.get(key, ()), name)
    there = set(shape_names)
    return {
        name: (name,) if name in there else (own[key],) if key in own else parts[key]
        for name, key in keys.items()
        if key in parts
    }


@cache
def _convention_keys() -> tuple[Mapping[str, tuple[str, str]], ...]:
    """Return the `shape_key` of every name of each of `NAMING_CONVENTIONS`."""
    return tuple(
        {
            name: shape_key(name)
            for unit in convention.units
            for name, _ in convention.names(ActionUnit(unit))
        }
        for convention in NAMING_CONVENTIONS
    )


def _composed(pose: ActionPose, shapes: _KnownShapes) -> tuple[list[Expression], list[Finding]]:
    """Return the pose as weights of shapes, unless the rig cannot show half of its units."""
    weights: dict[str, float] = {}
    missing = []
    for unit, strength in pose.units.items():
        shown = shapes.of_unit(unit)
        for name, weight in shown:
            weights[name] = max(weights.get(name, 0.0), round(strength * weight, 6))
        if not shown:
            missing.append(str(unit))
    if 2 * len(missing) > len(pose.units):
        return [], [finding("EXPRESSION_UNKNOWN", pose.name)]
    made = Expression(pose.name, tuple(weights), np.array(list(weights.values())), pose.gain)
    if not missing:
        return [made], []
    message = "the rig has no blend shape for {shapes}; left out of {expression}"
    return [made], [finding("SHAPE_UNKNOWN", pose.name, message, missing, pose.name)]
