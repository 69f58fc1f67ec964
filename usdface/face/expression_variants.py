"""Variants of expressions: the action units that other people show an emotion with.

Few people show the prototype of an emotion whole. `VARIANTS` has the combinations of facial action
units that FACS lists as prototypes and major variants of each emotion (P. Ekman, W. Friesen,
J. Hager, "Facial Action Coding System: Investigator's Guide", 2002), as far as they are of one
emotion alone. `AMBIGUOUS` has those that are also most of another emotion's: a raised upper lip is
of anger and of disgust, raised brows that are drawn together under an open mouth are of fear and,
on many faces, of surprise. These say nothing for their own emotion, but against all others.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.expression_poses import composed_pose
from usdface.retarget_setup import Expression

__all__ = ["AMBIGUOUS", "VARIANTS", "Variant", "expression_variants"]

_Units = tuple[tuple[int, ...], ...]
VARIANTS: dict[str, _Units] = {
    "joy": ((6, 12), (12,), (6, 12, 25), (6, 12, 26), (6, 7, 12, 25)),
    "sadness": (
        *((1, 4, 15), (1, 4, 15, 17), (1, 4, 17), (1, 4, 15, 25), (1, 15), (1, 4, 15, 43)),
        (1, 4, 11, 15),
    ),
    "anger": (
        *((4, 5, 7, 23), (4, 5, 7, 17, 23), (4, 5, 7, 17, 24), (4, 5, 7, 24), (4, 7, 23)),
        *((4, 7, 24), (4, 7, 17, 24), (4, 5, 7, 23, 25), (4, 5, 7, 23, 26)),
    ),
    "fear": (
        *((1, 2, 4, 5, 20), (1, 2, 4, 5, 20, 25), (1, 2, 4, 5, 20, 26), (1, 2, 4, 5, 7, 20, 27)),
        *((1, 4, 5, 20, 26), (1, 2, 5, 20, 26)),
    ),
    "disgust": (
        *((9,), (9, 25), (9, 16, 25), (9, 15, 16, 26), (4, 9), (4, 7, 9, 10), (9, 10, 25)),
        (9, 17),
    ),
    "surprise": ((1, 2, 26), (1, 2, 27), (1, 2, 5, 26), (1, 2, 5, 27), (1, 2, 5, 25, 26)),
}
AMBIGUOUS: dict[str, _Units] = {
    "joy": ((6, 10, 12, 25),),
    "sadness": ((6, 15), (15, 17)),
    "anger": (
        *((4, 5, 7, 10, 22, 23, 25), (4, 5, 7, 10, 23, 26), (4, 7, 10, 23, 25)),
        (4, 5, 7, 10, 25),
    ),
    "fear": ((1, 2, 4, 5, 26), (1, 2, 4, 5)),
    "disgust": ((10,), (10, 16, 25), (10, 17), (9, 10, 16, 25)),
    "surprise": ((1, 2, 5),),
}
# Strengths of the units of brows and lids and of all others: alike, and either half weaker.
_STRENGTHS = ((0.8, 0.8), (0.5, 0.9), (0.9, 0.5))
_UPPER = frozenset((1, 2, 4, 5, 6, 7, 43))
# A jaw that drops whole is speech or a yawn; less is of an expression.
_JAW, _JAW_STRENGTH = frozenset((26, 27)), 0.6


@dataclass(frozen=True, eq=False, slots=True)
class Variant:
    """A variant of an expression.

    Attributes
    ----------
    emotion : str
    units : tuple of int
        Action units; empty for the pose itself.
    weights : (S,) float64
    heard : bool
        Whether a face that is like it shows the emotion; otherwise it only speaks against others.
    """

    emotion: str
    units: tuple[int, ...]
    weights: FloatArray
    heard: bool = True


def expression_variants(
    expressions: Sequence[Expression], shape_names: tuple[str, ...]
) -> tuple[Variant, ...]:
    """Return the poses, and the variants of those that FACS lists, on a rig with S blend shapes.

    Variants need blend shapes with known names; other rigs have the poses alone.
    """
    found = [Variant(e.name, (), e.pose(shape_names)) for e in expressions]
    for expression in expressions:
        for table, heard in ((VARIANTS, True), (AMBIGUOUS, False)):
            for units in table.get(expression.name, ()):
                found += _shown(expression.name, units, shape_names, heard)
    return tuple(found)


def _shown(
    emotion: str, units: tuple[int, ...], shape_names: tuple[str, ...], heard: bool
) -> list[Variant]:
    """Return a variant at several strengths; none where the rig lacks half of its units."""
    found = []
    for upper, lower in _STRENGTHS:
        shares = {
            unit: (upper if unit in _UPPER else lower) * (_JAW_STRENGTH if unit in _JAW else 1.0)
            for unit in units
        }
        if (made := composed_pose(shares, shape_names)) is not None:
            found.append(Variant(emotion, units, np.array(made.pose(shape_names)), heard))
    return found
