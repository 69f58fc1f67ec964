"""Variants of expressions: the action units that other people show an emotion with.

Few people show the prototype of an emotion whole. `VARIANTS` has the combinations of facial action
units that FACS lists as prototypes and major variants of each emotion (P. Ekman, W. Friesen,
J. Hager, "Facial Action Coding System: Investigator's Guide", 2002), as far as they are of one
emotion alone. `usdface.face.drawn_expressions` has those that people and artists show.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from usdface.arrays import FloatArray
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import composed_pose
from usdface.retarget_setup import Expression

__all__ = ["VARIANTS", "Variant", "expression_variants"]

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
    weights : (S,) float64
    source : str
        "pose", "FACS", or one of `DRAWN`.
    """

    emotion: str
    weights: FloatArray
    source: str


def expression_variants(
    expressions: Sequence[Expression],
    shape_names: tuple[str, ...],
    drawn: Collection[str] = DRAWN,
) -> tuple[Variant, ...]:
    """Return the poses, those that FACS lists and those of `drawn`, on a rig with S blend shapes.

    Variants need blend shapes with known names; other rigs have the poses alone. A variant is left
    out where the rig lacks half of its units.
    """
    names = [expression.name for expression in expressions]
    found = [Variant(e.name, e.pose(shape_names), "pose") for e in expressions]

    def show(emotion: str, units: Mapping[int, float], source: str) -> None:
        if emotion in names and (made := composed_pose(units, shape_names)) is not None:
            found.append(Variant(emotion, made.pose(shape_names), source))

    for emotion in names:
        for units in VARIANTS.get(emotion, ()):
            for upper, lower in _STRENGTHS:
                shares = {
                    unit: (upper if unit in _UPPER else lower)
                    * (_JAW_STRENGTH if unit in _JAW else 1.0)
                    for unit in units
                }
                show(emotion, shares, "FACS")
    for source in drawn:
        for emotion, strengths in DRAWN[source]:
            show(emotion, strengths, source)
    return tuple(found)
