"""Constraints on the weights of a solve: bounds, pins and linear inequalities, by frame."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, frozen
from usdface.errors import InputError

__all__ = ["UNIT", "Bounds"]


def _no_rows() -> FloatArray:
    return np.zeros((0, 0))


@dataclass(frozen=True, eq=False, slots=True)
class Bounds:
    """Bounds of the weights: ``lower <= w <= upper`` and ``rows @ w <= limits`` in each frame.

    Attributes
    ----------
    lower, upper : float, (S,) or (F, S) float64
        Finite. A pin is a frame and shape in which both are equal.
    rows : (C, S) float64
        Inequalities, each with few entries: ``w_i <= w_j`` is 1 at i and -1 at j.
    limits : float, (C,) or (F, C) float64
        Where a row is infeasible within the bounds, the bounds take precedence.
    """

    lower: FloatArray = field(default_factory=lambda: np.zeros(()))
    upper: FloatArray = field(default_factory=lambda: np.ones(()))
    rows: FloatArray = field(default_factory=_no_rows)
    limits: FloatArray = field(default_factory=lambda: np.zeros(()))

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "rows", "limits"):
            values = frozen(getattr(self, name))
            if not np.isfinite(values).all():
                raise InputError(f"the {name} of the weights must be finite")
            object.__setattr__(self, name, values)
        if not (self.lower <= self.upper).all():
            raise InputError("a weight's lower bound is above its upper bound")
        if self.rows.ndim != 2:
            raise InputError(f"rows have shape {self.rows.shape}; expected (rows, blend shapes)")

    def over(self, frames: int, size: int) -> tuple[FloatArray, FloatArray]:
        """Return the lower and upper bound of every weight: two (F, S), not to be written to."""
        shape = (frames, size)
        return np.broadcast_to(self.lower, shape), np.broadcast_to(self.upper, shape)

    def limits_over(self, frames: int) -> FloatArray:
        """Return the limit of every row: (F, C), not to be written to."""
        return np.broadcast_to(self.limits, (frames, len(self.rows)))

    def at(self, frames: Any) -> "Bounds":
        """Return the bounds of some frames of the take, a slice or indices."""

        def part(values: FloatArray) -> FloatArray:
            return values[frames] if values.ndim == 2 else values

        return Bounds(part(self.lower), part(self.upper), self.rows, part(self.limits))


UNIT = Bounds()
