"""Variants of expressions on a rig: its own poses, and those of `usdface.face.drawn_expressions`.

Few people show all units of an emotion's prototype; these are the units that people and artists
show.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from usdface.arrays import FloatArray
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import composed_pose
from usdface.setup.expression import Expression

__all__ = ["Variant", "expression_variants"]


@dataclass(frozen=True, eq=False, slots=True)
class Variant:
    """A variant of an expression.

    Attributes
    ----------
    emotion : str
    weights : (S,) float64
    source : str
        "pose", or one of `DRAWN`.
    """

    emotion: str
    weights: FloatArray
    source: str


def expression_variants(
    expressions: Sequence[Expression],
    shape_names: tuple[str, ...],
    drawn: Collection[str] = DRAWN,
) -> tuple[Variant, ...]:
    """Return the poses and the expressions of `drawn` on a rig with S blend shapes.

    Variants need blend shapes with known names; other rigs have the poses alone. A variant is left
    out where the rig lacks half of its units.
    """
    names = [expression.name for expression in expressions]
    found = [Variant(e.name, e.pose(shape_names), "pose") for e in expressions]

    def show(emotion: str, units: Mapping[int, float], source: str) -> None:
        if emotion in names and (made := composed_pose(units, shape_names)) is not None:
            found.append(Variant(emotion, made.pose(shape_names), source))

    for source in drawn:
        for emotion, strengths in DRAWN[source]:
            show(emotion, strengths, source)
    return tuple(found)
