"""Expression poses for rigs whose blend shapes carry known names.

Two tables and their product. `EMOTIONS` says which facial action units make an emotion and how
strongly: the emotion prototypes of FACS, as in P. Ekman, W. Friesen, J. Hager, "Facial Action
Coding System: Investigator's Guide", 2002 (EMFACS: joy 6 + 12, sadness 1 + 4 + 15, anger
4 + 5 + 7 + 23, fear 1 + 2 + 4 + 5 + 7 + 20 + 26, disgust 9 + 15 + 16, surprise 1 + 2 + 5B + 26;
the letter B is a slight intensity). A `Family` says which blend shapes of a naming convention
show an action unit. Strengths are chosen so that the poses look right and differ clearly.
A rig with shapes named after the emotions themselves needs neither.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.findings import Finding, finding
from usdface.setup import Expression

__all__ = [
    "ARKIT",
    "EMOTIONS",
    "FAMILIES",
    "MAKEHUMAN",
    "NAMED",
    "Family",
    "expressions_for",
    "units_of",
]

EMOTIONS: dict[str, dict[int, float]] = {
    "joy": {6: 0.8, 12: 0.9},
    "sadness": {1: 1.0, 4: 0.4, 15: 0.9, 17: 0.4},
    "anger": {4: 1.0, 5: 0.6, 7: 0.7, 23: 0.9},
    "fear": {1: 0.9, 2: 0.6, 4: 0.4, 5: 1.0, 7: 0.2, 20: 1.0, 26: 0.25},
    "disgust": {9: 1.0, 15: 0.4, 16: 0.5},
    "surprise": {1: 1.0, 2: 1.0, 5: 0.6, 26: 0.7},
}


@dataclass(frozen=True, slots=True)
class Family:
    """A naming convention: which blend shapes show an action unit, at which weight.

    `{side}` in a name stands for each of `sides`; names that a rig lacks are left out.
    """

    name: str
    sides: tuple[str, ...]
    units: Mapping[int, Mapping[str, float]]

    def names(self, unit: int) -> Iterator[tuple[str, float]]:
        """Return every name that may stand for the unit, with its weight."""
        for template, weight in self.units[unit].items():
            names = dict.fromkeys(template.format(side=side) for side in self.sides)
            yield from ((name, weight) for name in names)


# ARKit's 52 shapes. ICT-FaceKit and others say _L, _R, and some split browInnerUp.
ARKIT = Family(
    "ARKit",
    ("Left", "Right", "_L", "_R", ""),
    {
        1: {"browInnerUp{side}": 1.0},
        2: {"browOuterUp{side}": 1.0},
        4: {"browDown{side}": 1.0},
        5: {"eyeWide{side}": 1.0},
        6: {"cheekSquint{side}": 1.0},
        7: {"eyeSquint{side}": 1.0},
        # The nose wrinkler pulls the upper lip along; ARKit has that as a shape of its own.
        9: {"noseSneer{side}": 1.0, "mouthUpperUp{side}": 0.5},
        12: {"mouthSmile{side}": 1.0},
        15: {"mouthFrown{side}": 1.0},
        16: {"mouthLowerDown{side}": 1.0},
        17: {"mouthShrugLower": 1.0},
        20: {"mouthStretch{side}": 1.0},
        23: {"mouthPress{side}": 1.0, "mouthRollLower": 0.3, "mouthRollUpper": 0.3},
        26: {"jawOpen": 1.0},
    },
)

# MakeHuman's expression units. They have no cheek raiser; narrowed lids stand in for it.
MAKEHUMAN = Family(
    "MakeHuman",
    ("left", "right"),
    {
        1: {"eyebrows-{side}-inner-up": 1.0},
        2: {"eyebrows-{side}-extern-up": 1.0},
        4: {"eyebrows-{side}-down": 1.0},
        5: {"eye-{side}-opened-up": 1.0},
        6: {"eye-{side}-slit": 0.5},
        7: {"eye-{side}-slit": 1.0},
        9: {"nose-{side}-elevation": 1.0, "nose-compression": 1.0, "mouth-elevation": 0.8},
        12: {"mouth-corner-puller": 1.0},
        15: {"mouth-depression": 1.0},
        16: {"mouth-depression-retraction": 1.0},
        17: {"mouth-elevation": 0.8},
        20: {"mouth-retraction": 1.0, "neck-platysma": 0.6},
        23: {"mouth-eversion": 0.8},
        26: {"mouth-open": 0.8},
    },
)

FAMILIES = (ARKIT, MAKEHUMAN)

NAMED: dict[str, tuple[str, ...]] = {
    "joy": ("joy", "joyful", "happy", "happiness"),
    "sadness": ("sadness", "sad"),
    "anger": ("anger", "angry"),
    "fear": ("fear", "fearful", "afraid", "scared"),
    "disgust": ("disgust", "disgusted"),
    "surprise": ("surprise", "surprised"),
}


def expressions_for(
    shape_names: Sequence[str],
) -> tuple[tuple[Expression, ...], list[Finding]]:
    """Make the expression poses that a rig can show.

    A shape named after the emotion (`NAMED`, in any case) is the pose; otherwise the pose is
    put together from action units, in the family that most of the rig's names belong to.

    Parameters
    ----------
    shape_names : sequence of str
        Blend shapes of the rig.

    Returns
    -------
    expressions : tuple of Expression
        In the order of `EMOTIONS`; without those for which the rig has too few shapes.
    findings : list of Finding
        EXPRESSION_UNKNOWN for each that is left out, SHAPE_UNKNOWN for each that lacks units.
    """
    family = max(FAMILIES, key=lambda family: len(_known(family, shape_names)))
    expressions, findings = [], []
    for emotion in EMOTIONS:
        named = [name for name in shape_names if name.lower() in NAMED[emotion]]
        if named:
            expressions.append(Expression(emotion, (named[0],), np.ones(1)))
            continue
        pose, missing = _composed(emotion, family, shape_names)
        if 2 * len(missing) > len(EMOTIONS[emotion]):
            findings.append(finding("EXPRESSION_UNKNOWN", emotion))
            continue
        expressions.append(Expression(emotion, tuple(pose), np.array(list(pose.values()))))
        if missing:
            units = ", ".join(f"AU{unit}" for unit in missing)
            message = f"the rig has no shape for {units}; {emotion} does without"
            findings.append(finding("SHAPE_UNKNOWN", emotion, message))
    return tuple(expressions), findings


def units_of(shape_names: Sequence[str]) -> dict[str, set[int]]:
    """Return the action units that each shape stands for; without the shapes that stand for none.

    In the family that most of the names belong to.
    """
    family = max(FAMILIES, key=lambda family: len(_known(family, shape_names)))
    units: dict[str, set[int]] = {}
    for unit in family.units:
        for name, _ in family.names(unit):
            if name in shape_names:
                units.setdefault(name, set()).add(unit)
    return units


def _known(family: Family, shape_names: Sequence[str]) -> set[str]:
    return {name for unit in family.units for name, _ in family.names(unit)} & set(shape_names)


def _composed(
    emotion: str, family: Family, shape_names: Sequence[str]
) -> tuple[dict[str, float], list[int]]:
    """Return the pose as weights of shapes, and the action units that the rig cannot show."""
    pose: dict[str, float] = {}
    missing = []
    for unit, strength in EMOTIONS[emotion].items():
        shown = [(n, w) for n, w in family.names(unit) if n in shape_names]
        for name, weight in shown:
            pose[name] = max(pose.get(name, 0.0), round(strength * weight, 6))
        if not shown:
            missing.append(unit)
    return pose, missing
