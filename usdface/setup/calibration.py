"""The calibration of a performer: how their movements relate to the blend shapes."""

from dataclasses import dataclass

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, freeze
from usdface.errors import InputError
from usdface.options import LARGEST_OFFSET, PERFORMER_GAIN_RANGE
from usdface.setup.performer_face import PerformerFace

__all__ = ["Calibration"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Calibration:
    """The relation of a performer's movements to the character's blend shapes.

    A performer's weight w of shape k moves the markers as ``gains[k] * w - offsets[k]`` times
    the character's shape does; shapes that are not named have gain 1 and offset 0.

    Attributes
    ----------
    shapes : tuple of str, length K
    gains : (K,) float64
        How large each movement is against the character's, in
        `usdface.options.PERFORMER_GAIN_RANGE`.
    offsets : (K,) float64
        How far the performer's neutral is from rest, 0 to `usdface.options.LARGEST_OFFSET`. A
        take's own `RetargetSetup.neutral_weights` override the offset of a shape.
    face : PerformerFace or None
        Where the performer's markers sit, and how the shapes move them.

    Examples
    --------
    >>> calibration = usdface.Calibration(("jawOpen",), [1.3], [0.05])
    >>> float(calibration.of(("mouthPucker", "jawOpen"))[0][1])
    1.3
    """

    shapes: tuple[str, ...]
    gains: FloatArray
    offsets: FloatArray
    face: PerformerFace | None = None

    def __post_init__(self) -> None:
        freeze(self, "gains", "offsets")
        count = len(self.shapes)
        if len(set(self.shapes)) != count:
            raise InputError("the calibration names a blend shape twice", "NAME_REPEATED")
        for name, values, low, high in (
            ("gains", self.gains, *PERFORMER_GAIN_RANGE),
            ("offsets", self.offsets, 0.0, LARGEST_OFFSET),
        ):
            if values.shape != (count,):
                raise InputError(
                    f"the calibration has {values.size} {name} for {count} blend shapes",
                    "WEIGHTS_LENGTH_WRONG",
                )
            # Files hold single precision.
            good = (values >= low - 1e-6) & (values <= high + 1e-6)
            if not good.all():
                worst = int(np.argmin(good))
                raise InputError(
                    f"the calibration's {name} must lie in {low:g} to {high:g}; "
                    f"{self.shapes[worst]!r} has {values[worst]:g}",
                    "SETTING_WRONG",
                )

    def of(self, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """Return gains and offsets in the order of `names`: (len(names),), (len(names),)."""
        own = {n: k for k, n in enumerate(self.shapes)}
        gains, offsets = np.ones(len(names)), np.zeros(len(names))
        for place, name in enumerate(names):
            if name in own:
                k = own[name]
                gains[place], offsets[place] = self.gains[k], self.offsets[k]
        return gains, offsets
