"""An expression pose of a character."""

from dataclasses import dataclass

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, freeze
from usdface.errors import InputError

__all__ = ["Expression"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Expression:
    """An expression pose: one key shape of the rig as weights of its blend shapes.

    Attributes
    ----------
    name : str
        The emotion.
    shapes : tuple of str, length K
    weights : (K,) float64
        In [0, 1].
    gain : float
        Factor on its pose: weights are raised to this much of it.

    Raises
    ------
    InputError
        If the weights are not as many as the shapes, or not in [0, 1].

    Examples
    --------
    >>> joy = usdface.Expression("joy", ("mouthSmileLeft", "mouthSmileRight"), [0.9, 0.9])
    >>> joy.pose(("jawOpen", "mouthSmileLeft")).tolist()
    [0.0, 0.9]
    """

    name: str
    shapes: tuple[str, ...]
    weights: FloatArray
    gain: float = 1.0

    def __post_init__(self) -> None:
        freeze(self, "weights")
        if self.weights.shape != (len(self.shapes),):
            raise InputError(
                f"expression {self.name!r} has {self.weights.size} weights "
                f"for {len(self.shapes)} shapes",
                "WEIGHTS_LENGTH_WRONG",
            )
        for shape, weight in zip(self.shapes, self.weights.tolist(), strict=True):
            if not 0 <= weight <= 1:
                raise InputError(
                    f"expression {self.name!r}: {shape} is {weight:g}; expected 0 to 1",
                    "SETTING_WRONG",
                )

    def pose(self, names: tuple[str, ...]) -> FloatArray:
        """Return the weights in the order of `names`: (len(names),); others are left out."""
        own = dict(zip(self.shapes, self.weights, strict=True))
        return np.array([own.get(name, 0.0) for name in names])
