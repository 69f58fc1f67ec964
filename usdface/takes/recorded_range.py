"""The range of recorded values: takes beyond it are not read."""

import numpy as np

from usdface.errors import InputError
from usdface.takes.marker_take import FARTHEST, MarkerTake
from usdface.takes.weights_take import WeightsTake

__all__ = ["check_range"]

_LARGEST_WEIGHT = 1000.0  # 10 times 100 %, where someone means per cent


def check_range(take: MarkerTake | WeightsTake) -> None:
    """Refuse a take from a file whose numbers are beyond any volume or meaning.

    Raises
    ------
    InputError
        If a marker lies beyond `FARTHEST`, or a weight beyond 1000 either side of 0.
    """
    if isinstance(take, MarkerTake):
        # Without a copy: NaN if no marker is seen at all.
        low, high = np.fmin.reduce(take.positions, None), np.fmax.reduce(take.positions, None)
        if low < -FARTHEST or high > FARTHEST:
            raise InputError(
                f"markers lie beyond {FARTHEST / 1000:g} km from the origin", "VALUES_WRONG"
            )
    elif (np.abs(take.weights) > _LARGEST_WEIGHT).any():
        raise InputError(
            f"blend shape weights go up to {np.abs(take.weights).max():g}; expected 0 to 1",
            "VALUES_WRONG",
        )
