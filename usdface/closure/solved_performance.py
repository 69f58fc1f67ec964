"""A performance as it was solved on a face, which eyes and lips are closed by."""

from collections.abc import Sequence
from dataclasses import dataclass

from usdface.arrays import FloatArray, freeze
from usdface.face.bound_face import BoundFace
from usdface.retarget.pins import pin_nearness
from usdface.retarget.solution import Solution
from usdface.setup.pin import Pin
from usdface.takes import WeightsTake

__all__ = ["SolvedPerformance"]


@dataclass(frozen=True, eq=False, slots=True)
class SolvedPerformance:
    """Weights of T blend shapes before any correction, and the solution that they are of.

    Attributes
    ----------
    face : BoundFace
    solved : WeightsTake
        Exaggerated, where that is requested.
    performed : WeightsTake
        The same before their exaggeration: markers are compared with these.
    solution : Solution or None
        Of the markers; None of a take of weights.
    near_pins : (F, T) float64
        `usdface.retarget.pins.pin_nearness`.
    """

    face: BoundFace
    solved: WeightsTake
    performed: WeightsTake
    solution: Solution | None
    near_pins: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "near_pins")

    @classmethod
    def of(
        cls,
        face: BoundFace,
        solved: WeightsTake,
        solution: Solution | None,
        pins: Sequence[Pin] = (),
        performed: WeightsTake | None = None,
    ) -> "SolvedPerformance":
        """Return a performance that pins hold; `performed` is as `solved`, if left out."""
        near_pins = pin_nearness(pins, solved.names, solved.times)
        return cls(face, solved, performed or solved, solution, near_pins)

    @property
    def is_exaggerated(self) -> bool:
        """Whether the solved weights are not as performed."""
        return self.performed is not self.solved
