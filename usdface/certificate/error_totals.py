"""Largest and mean of errors, with and without rounding."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray

__all__ = ["ErrorTotals", "largest"]


def largest(errors: NDArray[Any]) -> float:
    """Return the largest error, at least 0; infinity where a value is NaN."""
    found = float(errors.max(initial=0.0))
    return np.inf if np.isnan(found) else found


class ErrorTotals:
    """Largest and mean of numbers that come in blocks, and the largest beyond rounding."""

    def __init__(self) -> None:
        self.largest, self.total, self.count = 0.0, 0.0, 0
        self.excess = self.rounding = 0.0

    def add(self, values: NDArray[Any], rounding: FloatArray | None = None, times: int = 1) -> None:
        """Add numbers, each so many times, that may be off by `rounding`."""
        self.largest = max(self.largest, largest(values))
        if rounding is None:
            self.excess = max(self.excess, largest(values))
        elif values.size:
            self.excess = max(self.excess, largest(values - rounding))
            self.rounding = max(self.rounding, float(rounding.max()))
        self.total += times * float(values.sum())
        self.count += times * values.size

    def set_excess(self, before: float, requested: "ErrorTotals") -> None:
        """Let the excess be that of a source as requested, or one of `before` if that is larger."""
        self.excess = max(before, requested.excess)
        self.rounding = max(self.rounding, requested.rounding)

    @property
    def mean(self) -> float:
        """0 of no numbers."""
        return self.total / max(self.count, 1)
