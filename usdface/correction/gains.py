"""Gains over a take: of the whole system, of each emotion, of each region of the face."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray, freeze, frozen
from usdface.errors import InputError
from usdface.face.regions import GainRegion
from usdface.frozen_mapping import FrozenMapping
from usdface.setup.expression import Expression

__all__ = ["Gains"]

_ONE = np.ones(1)


@dataclass(frozen=True, eq=False, slots=True)
class Gains:
    """Factors on the emotions' poses: each (F,) over the take, or (1,) where it is constant.

    Attributes
    ----------
    system : (F,) or (1,) float64
    emotions : mapping of str to array
        Those that are not in it have 1.
    regions : mapping of "brows", "eyes", "mouth" to array
        Likewise.
    """

    system: FloatArray = field(default_factory=_ONE.copy)
    emotions: Mapping[str, FloatArray] = field(default_factory=dict)
    regions: Mapping[GainRegion, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "system")
        for name in ("emotions", "regions"):
            curves = {key: frozen(curve) for key, curve in getattr(self, name).items()}
            object.__setattr__(self, name, FrozenMapping(curves))
        for curve in (self.system, *self.emotions.values(), *self.regions.values()):
            if curve.ndim != 1 or not (np.isfinite(curve) & (curve >= 0)).all():
                raise InputError(f"a gain is {curve.min(initial=np.inf)}; expected 0 or more")

    @classmethod
    def constant(cls, system: float, expressions: Sequence[Expression]) -> "Gains":
        """Return the gains of a system and of expressions as they are at all times."""
        return cls(np.array([system]), {e.name: np.array([e.gain]) for e in expressions})

    def of_emotions(self, emotions: Sequence[str], frames: int) -> FloatArray:
        """Return the gain of each emotion over the take, without the system's: (frames, E)."""
        return self.of([(emotion, None) for emotion in emotions], frames)

    def of(self, parts: Sequence[tuple[str, GainRegion | None]], frames: int) -> FloatArray:
        """Return the gain of each emotion in each region over the take: (frames, len(parts)).

        The system's own is left out.
        """
        gains = np.ones((frames, len(parts)))
        for column, (emotion, region) in zip(gains.T, parts, strict=True):
            column *= self.emotions.get(emotion, _ONE)
            if region is not None:
                column *= self.regions.get(region, _ONE)
        return gains
