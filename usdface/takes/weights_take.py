"""A take of weights: blend shape weights over time."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, freeze
from usdface.errors import InputError, did_you_mean
from usdface.short_repr import short_repr
from usdface.takes.take_axes import check_names, check_rate, check_times

__all__ = ["WeightsTake"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class WeightsTake:
    """Blend shape weights over time; column s belongs to ``names[s]``.

    Attributes
    ----------
    names : tuple of str, length S
        Blend shape names, unique.
    times : (F,) float64 [s]
        Strictly increasing.
    weights : (F, S) float64 [1]
    rate : float [Hz]
        Nominal frame rate; 0 where unknown.
    start_timecode, source : str
        As in `MarkerTake`.
    head : (F, 3) float64 [rad], optional
        Rotation vectors of the recorded head, with x to its left, y up and z ahead.

    Examples
    --------
    >>> take = usdface.WeightsTake(("jawOpen",), [0.0, 0.5], [[0.0], [1.0]])
    >>> take.column("jawOpen").tolist()
    [0.0, 1.0]
    """

    __repr__ = short_repr

    names: tuple[str, ...]
    times: FloatArray
    weights: FloatArray
    rate: float = 0.0
    start_timecode: str = ""
    source: str = ""
    head: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "times", "weights")
        shape = self.weights.shape
        if len(shape) != 2 or shape[1] != len(self.names):
            raise InputError(
                f"weights have shape {shape}; expected (frames, {len(self.names)})",
                "WEIGHTS_LENGTH_WRONG",
            )
        check_names(self.names, "blend shape")
        check_times(self.times, shape[0], "weights take")
        check_rate(self.rate, "weights take")
        if not np.isfinite(self.weights).all():
            raise InputError("blend shape weights must be finite", "VALUES_WRONG")
        if self.head is not None:
            freeze(self, "head")
            if self.head.shape != (shape[0], 3) or not np.isfinite(self.head).all():
                raise InputError(
                    f"the head's rotation vectors have shape {self.head.shape}, or are not finite; "
                    f"expected ({shape[0]}, 3)",
                    "VALUES_WRONG",
                )

    def column(self, name: str) -> FloatArray:
        """Return the curve of one blend shape: (F,).

        Raises
        ------
        InputError
            If the take has no such blend shape.
        """
        if name not in self.names:
            raise InputError(
                f"the take {self.source} has no blend shape {name!r}"
                f"{did_you_mean(name, self.names)}",
                "SHAPE_UNKNOWN",
            )
        return self.weights[:, self.names.index(name)]

    def reordered(self, names: tuple[str, ...]) -> "WeightsTake":
        """Return the take with exactly these columns; a name it lacks gives zeros."""
        columns = {n: i for i, n in enumerate(self.names)}
        weights = np.zeros((len(self.times), len(names)))
        for target, name in enumerate(names):
            if name in columns:
                weights[:, target] = self.weights[:, columns[name]]
        return replace(self, names=names, weights=weights)
