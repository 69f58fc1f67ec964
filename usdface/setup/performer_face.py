"""A performer's face: places of the markers on the character, and their displacements by shapes."""

from dataclasses import dataclass

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError

__all__ = ["PerformerFace"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class PerformerFace:
    """A performer's face, learned from takes; part of a `Calibration`.

    Attributes
    ----------
    markers : tuple of str, length M
    vertices : (M,) int64
        Of the character, which the markers are bound to.
    shifts : (M, 3) float64 [m]
        On the character, from those vertices to where the markers sit.
    rest : (M, 3) float64 [m]
        Neutral markers, in the space of the take that they were learned from.
    frames : int
        Neutral frames that `rest` is the mean of; 0 = exact.
    shapes : tuple of str, length S
    displacements : (S, M, 3) float64 [m]
        Of the resting markers by each blend shape at weight 1, in the space of `rest`.

    Raises
    ------
    InputError
        If the arrays do not belong together.

    Examples
    --------
    >>> face = usdface.PerformerFace(
    ...     ("chin",), [812], [[0, 0, 0.001]], [[0, 0, 0]], 30, ("jawOpen",), [[[0, -0.02, 0]]]
    ... )
    >>> face.displacements.shape
    (1, 1, 3)
    """

    markers: tuple[str, ...]
    vertices: IntArray
    shifts: FloatArray
    rest: FloatArray
    frames: int
    shapes: tuple[str, ...]
    displacements: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "vertices", dtype=np.int64)
        freeze(self, "shifts", "rest", "displacements")
        count = len(self.markers)
        expected = {
            "vertices": (count,),
            "shifts": (count, 3),
            "rest": (count, 3),
            "displacements": (len(self.shapes), count, 3),
        }
        for name, shape in expected.items():
            values = getattr(self, name)
            if values.shape != shape or not np.isfinite(values).all():
                raise InputError(
                    f"the performer's {name} must be finite, of shape {shape} for {count} markers "
                    f"and {len(self.shapes)} blend shapes; got {values.shape}",
                    "VALUES_WRONG",
                )
        for name, names in (("marker", self.markers), ("blend shape", self.shapes)):
            if len(set(names)) != len(names):
                raise InputError(f"the performer's face names a {name} twice", "NAME_REPEATED")
        if self.frames < 0:
            raise InputError("the performer's face has less than 0 frames", "SETTING_WRONG")
