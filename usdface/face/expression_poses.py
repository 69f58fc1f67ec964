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
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from usdface.errors import InputError
from usdface.face.facs_names import NAMING_CONVENTIONS, ActionUnit, NamingConvention
from usdface.findings import Finding, finding
from usdface.setup.expression import Expression

__all__ = ["EMOTIONS", "NAMED", "ActionPose", "composed_pose", "expressions_for", "units_of"]


@dataclass(frozen=True, slots=True)
class ActionPose:
    """An expression as action units, which any rig with a known naming convention can show.

    `units` has the strength of each, in [0, 1].
    """

    name: str
    units: Mapping[ActionUnit, float]
    gain: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))
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

# Names of blend shapes, of artists, VRM 1.0 ("happy"), VRM 0.x ("sorrow", "fun") and
# VRoid ("Fcl_ALL_Joy"). Those beyond the six count only where a rig has them.
NAMED: dict[str, tuple[str, ...]] = {
    "joy": ("joy", "joyful", "happy", "happiness", "fcl_all_joy"),
    "sadness": ("sadness", "sad", "sorrow", "fcl_all_sorrow"),
    "anger": ("anger", "angry", "fcl_all_angry"),
    "fear": ("fear", "fearful", "afraid", "scared"),
    "disgust": ("disgust", "disgusted"),
    "surprise": ("surprise", "surprised", "fcl_all_surprised"),
    "contempt": ("contempt", "contemptuous"),
    "relaxed": ("relaxed", "fun", "fcl_all_fun"),
}


def expressions_for(
    shape_names: Sequence[str],
    given: Mapping[str, Expression | ActionPose | None] = MappingProxyType({}),
) -> tuple[tuple[Expression, ...], list[Finding]]:
    """Return the expression poses of a rig.

    Poses that are `given` go first. A shape named after the emotion (`NAMED`, in any case; of
    several the first there) is the pose; otherwise it is composed of action units, in the naming
    convention of most of the rig's names.

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
    convention = _convention(tuple(shape_names))
    spelt: dict[str, list[str]] = {}
    for name in sorted(shape_names):
        spelt.setdefault(name.lower(), []).append(name)
    expressions, findings = [], []
    for emotion in NAMED:
        named = [name for word in NAMED[emotion] for name in spelt.get(word, ())]
        if emotion in given or not (named or emotion in EMOTIONS):
            continue
        if named:
            expressions.append(Expression(emotion, (named[0],), np.ones(1)))
            continue
        units = {ActionUnit(unit): strength for unit, strength in EMOTIONS[emotion].items()}
        shown, new_findings = _composed(ActionPose(emotion, units), convention, shape_names)
        expressions += shown
        findings += new_findings
    for pose in given.values():
        if isinstance(pose, ActionPose):
            shown, new_findings = _composed(pose, convention, shape_names)
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

    In the naming convention of most of the names.
    """
    return _units_of(tuple(shape_names))


@lru_cache(maxsize=8)
def _units_of(shape_names: tuple[str, ...]) -> Mapping[str, frozenset[int]]:
    convention, known = _convention(shape_names), set(shape_names)
    units: dict[str, set[int]] = {}
    for unit in convention.units:
        for name, _ in convention.names(ActionUnit(unit)):
            if name in known:
                units.setdefault(name, set()).add(unit)
    return MappingProxyType({name: frozenset(own) for name, own in units.items()})


def composed_pose(units: Mapping[int, float], shape_names: Sequence[str]) -> Expression | None:
    """Return action units with their strengths as a pose; None where a rig lacks half of them."""
    pose = ActionPose("units", {ActionUnit(unit): share for unit, share in units.items()})
    made, _ = _composed(pose, _convention(tuple(shape_names)), shape_names)
    return made[0] if made else None


@lru_cache(maxsize=8)
def _convention(shape_names: tuple[str, ...]) -> NamingConvention:
    """Return the naming convention of most of the names."""
    return max(NAMING_CONVENTIONS, key=lambda convention: len(_known(convention, shape_names)))


def _known(convention: NamingConvention, shape_names: Sequence[str]) -> set[str]:
    names = {name for unit in convention.units for name, _ in convention.names(ActionUnit(unit))}
    return names & set(shape_names)


def _composed(
    pose: ActionPose, convention: NamingConvention, shape_names: Sequence[str]
) -> tuple[list[Expression], list[Finding]]:
    """Return the pose as weights of shapes, unless the rig cannot show half of its units."""
    weights: dict[str, float] = {}
    missing = []
    for unit, strength in pose.units.items():
        shown = [(n, w) for n, w in convention.names(unit) if n in shape_names]
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
