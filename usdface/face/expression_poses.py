"""Expression poses for rigs whose blend shapes carry known names.

Two tables and their product. `EMOTIONS` says which facial action units make an emotion and how
strongly: the emotion prototypes of FACS, as in P. Ekman, W. Friesen, J. Hager, "Facial Action
Coding System: Investigator's Guide", 2002 (EMFACS: joy 6 + 12, sadness 1 + 4 + 15, anger
4 + 5 + 7 + 23, fear 1 + 2 + 4 + 5 + 7 + 20 + 26, disgust 9 + 15 + 16, surprise 1 + 2 + 5B + 26;
the letter B is a slight intensity). `usdface.face.facs_names` says which blend shapes of a naming
convention show an action unit. Strengths are chosen so that the poses look right and differ
clearly. A rig with shapes named after the emotions themselves needs neither. Emotions beyond
these are data: poses of shapes or of action units that somebody gives.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from usdface.errors import InputError
from usdface.face.facs_names import FAMILIES, ActionUnit, Family
from usdface.findings import Finding, finding
from usdface.retarget_setup import Expression

__all__ = ["EMOTIONS", "NAMED", "ActionPose", "expressions_for", "units_of"]


@dataclass(frozen=True, slots=True)
class ActionPose:
    """An expression as action units, which any rig of a known family can show.

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

# Words that shapes are called by, of artists, VRM 1.0 ("happy"), VRM 0.x ("sorrow", "fun") and
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
    """Make the expression poses that a rig can show.

    Poses that are `given` go first. A shape named after the emotion (`NAMED`, in any case) is the
    pose; otherwise it is put together from action units, in the family that most of the rig's
    names belong to.

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
        EXPRESSION_UNKNOWN for each that is left out, SHAPE_UNKNOWN for each that lacks units or
        shapes.
    """
    family = max(FAMILIES, key=lambda family: len(_known(family, shape_names)))
    expressions, findings = [], []
    for emotion in NAMED:
        named = [name for name in shape_names if name.lower() in NAMED[emotion]]
        if emotion in given or not (named or emotion in EMOTIONS):
            continue
        if named:
            expressions.append(Expression(emotion, (named[0],), np.ones(1)))
            continue
        units = {ActionUnit(unit): strength for unit, strength in EMOTIONS[emotion].items()}
        shown, new_findings = _composed(ActionPose(emotion, units), family, shape_names)
        expressions += shown
        findings += new_findings
    for pose in given.values():
        if isinstance(pose, ActionPose):
            shown, new_findings = _composed(pose, family, shape_names)
            expressions += shown
            findings += new_findings
        elif pose is not None:
            expressions.append(pose)
            findings += [
                finding("SHAPE_UNKNOWN", shape, f"{pose.name!r} names it")
                for shape in sorted(set(pose.shapes) - set(shape_names))
            ]
    return tuple(expressions), findings


def units_of(shape_names: Sequence[str]) -> dict[str, set[int]]:
    """Return the action units that each shape stands for; without the shapes that stand for none.

    In the family that most of the names belong to.
    """
    family = max(FAMILIES, key=lambda family: len(_known(family, shape_names)))
    units: dict[str, set[int]] = {}
    for unit in family.units:
        for name, _ in family.names(ActionUnit(unit)):
            if name in shape_names:
                units.setdefault(name, set()).add(unit)
    return units


def _known(family: Family, shape_names: Sequence[str]) -> set[str]:
    names = {name for unit in family.units for name, _ in family.names(ActionUnit(unit))}
    return names & set(shape_names)


def _composed(
    pose: ActionPose, family: Family, shape_names: Sequence[str]
) -> tuple[list[Expression], list[Finding]]:
    """Return the pose as weights of shapes, unless the rig cannot show half of its units."""
    weights: dict[str, float] = {}
    missing = []
    for unit, strength in pose.units.items():
        shown = [(n, w) for n, w in family.names(unit) if n in shape_names]
        for name, weight in shown:
            weights[name] = max(weights.get(name, 0.0), round(strength * weight, 6))
        if not shown:
            missing.append(str(unit))
    if 2 * len(missing) > len(pose.units):
        return [], [finding("EXPRESSION_UNKNOWN", pose.name)]
    made = Expression(pose.name, tuple(weights), np.array(list(weights.values())), pose.gain)
    if not missing:
        return [made], []
    message = f"the rig has no shape for {', '.join(missing)}; {pose.name} does without"
    return [made], [finding("SHAPE_UNKNOWN", pose.name, message)]
