"""Labelled examples: marker features of stretches of takes with a known emotion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, freeze
from usdface.errors import InputError
from usdface.expression_system import MarkerFeature

__all__ = ["NO_EMOTION", "Examples"]

NO_EMOTION = ""


@dataclass(frozen=True, eq=False, slots=True)
class Examples:
    """One row for each labelled stretch.

    Attributes
    ----------
    marker_features : tuple of MarkerFeature, length I
        The columns of `features`.
    direction_names : tuple of (str, str), length I
        Names of a negative and a positive value of each, e.g. ("lowered", "raised").
    features : (N, I) float64 [face unit]
        At the apex of the expression. NaN = occluded.
    emotions : tuple of str, length N
        `NO_EMOTION` = neutral, speech.
    variants : tuple of str, length N
        Ways to show one emotion, as with open and with closed mouth; "" = not distinguished.
    recordings : tuple of str, length N
        The take of each example.
    intensities : (N,) float64
        In (0, 1]: intensity of the emotion; 1 where the labels give none.
    noise : (I,) float64 [face unit]
        Standard deviation of each feature on a neutral face.
    movements : (P, I) float64 [face unit]
        Movements without emotion, e.g. single blend shapes.

    Raises
    ------
    InputError
        If lengths disagree, or an intensity is not in (0, 1].
    """

    marker_features: tuple[MarkerFeature, ...]
    direction_names: tuple[tuple[str, str], ...]
    features: FloatArray
    emotions: tuple[str, ...]
    variants: tuple[str, ...]
    recordings: tuple[str, ...]
    intensities: FloatArray
    noise: FloatArray
    movements: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "features", "intensities", "noise", "movements")
        count, width = len(self.emotions), len(self.marker_features)
        expected = {
            "features": (count, width),
            "variants": (count,),
            "recordings": (count,),
            "intensities": (count,),
            "direction_names": (width, 2),
            "noise": (width,),
            "movements": (len(self.movements), width),
        }
        for field, shape in expected.items():
            found = np.shape(getattr(self, field))
            if found != shape and shape[0]:
                raise InputError(f"{field} of the examples have shape {found}; expected {shape}")
        if not ((self.intensities > 0) & (self.intensities <= 1)).all():
            raise InputError("an intensity of the examples is not above 0 and at most 1")

    @property
    def names(self) -> tuple[str, ...]:
        """The emotions, in the order in which they first occur."""
        return tuple(dict.fromkeys(e for e in self.emotions if e != NO_EMOTION))

    @property
    def whole(self) -> FloatArray:
        """Features brought to full intensity: (N, I)."""
        return np.asarray(self.features / self.intensities[:, None])

    def rows(self, emotion: str, variant: str | None = None) -> BoolArray:
        """Return which examples show an emotion, in one variant or in any: (N,) bool."""
        right = [
            e == emotion and variant in (None, v)
            for e, v in zip(self.emotions, self.variants, strict=True)
        ]
        return np.array(right, dtype=bool)

    def variants_of(self, emotion: str) -> tuple[str, ...]:
        """Return the variants of an emotion, the most frequent first."""
        shown = [v for e, v in zip(self.emotions, self.variants, strict=True) if e == emotion]
        return tuple(sorted(set(shown), key=lambda v: (-shown.count(v), v)))

    def subset(self, rows: BoolArray) -> "Examples":
        """Return the examples of some rows (N,) bool."""
        return replace(
            self,
            features=self.features[rows],
            emotions=_picked(self.emotions, rows),
            variants=_picked(self.variants, rows),
            recordings=_picked(self.recordings, rows),
            intensities=self.intensities[rows],
        )


def _picked(values: Sequence[str], rows: BoolArray) -> tuple[str, ...]:
    return tuple(v for v, kept in zip(values, rows.tolist(), strict=True) if kept)
