"""Weights of a blend shape that are fixed in some frames."""

from dataclasses import dataclass

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError

__all__ = ["Pin"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Pin:
    """Weights of one blend shape that are fixed: `weights` (K,) in [0, 1] at `frames` (K,).

    `frames` are frame indices of the take, rising; there is at least one.

    Raises
    ------
    InputError
        If they are not, or not as many as weights, or a weight is outside 0 to 1.

    Examples
    --------
    >>> usdface.Pin("eyeBlinkLeft", [40, 41], [1.0, 1.0]).frames.tolist()
    [40, 41]
    """

    shape: str
    frames: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "frames", dtype=np.int64)
        freeze(self, "weights")
        if self.frames.ndim != 1 or self.frames.shape != self.weights.shape or not self.frames.size:
            raise InputError(
                f"the pins of {self.shape!r} are {self.weights.size} weights at {self.frames.size} "
                "frames; expected as many, and at least one",
                "WEIGHTS_LENGTH_WRONG",
            )
        if self.frames[0] < 0 or (np.diff(self.frames) <= 0).any():
            raise InputError(
                f"the frame indices of the pins of {self.shape!r} do not rise from 0 on",
                "SETTING_WRONG",
            )
        if not ((self.weights >= 0) & (self.weights <= 1)).all():
            raise InputError(f"a pin of {self.shape!r} is outside 0 to 1", "SETTING_WRONG")
