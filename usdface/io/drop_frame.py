"""Drop-frame timecode of NTSC video (SMPTE ST 12-1)."""

from typing import TypeVar

from usdface.arrays import FloatArray

__all__ = ["dropped_labels"]

_Minutes = TypeVar("_Minutes", int, FloatArray)


def dropped_labels(minutes: _Minutes, nominal: int) -> _Minutes:
    """Return how many frame labels were left out in whole minutes since midnight.

    The first two of each minute at 30 labels a second, four at 60, but none in every tenth.

    Parameters
    ----------
    minutes : int or (F,) float64
    nominal : int [Hz]
        Labels of a second: 30 or 60.

    >>> dropped_labels(9, 30), dropped_labels(10, 30), dropped_labels(60, 60)
    (18, 18, 216)
    """
    return round(nominal / 15) * (minutes - minutes // 10)
