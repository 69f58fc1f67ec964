"""The axes of a take: names of its columns, times of its frames."""

from math import isfinite

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = ["check_names", "check_rate", "check_times", "frame_step"]


def frame_step(times: FloatArray) -> float:
    """Return the median time between frames at `times` (F,) [s]; 0 for a single frame."""
    return float(np.median(np.diff(times))) if len(times) > 1 else 0.0


def check_names(names: tuple[str, ...], subject: str) -> None:
    """Refuse names that are not unique; `subject` names them in the error."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(
                f"{subject} name {name!r} occurs twice; names must be unique", "NAME_REPEATED"
            )
        seen.add(name)


def check_rate(rate: float, subject: str) -> None:
    """Refuse a frame rate that is none."""
    if not (isfinite(rate) and rate >= 0.0):
        raise InputError(
            f"the rate of the {subject} is {rate}; expected frames per second, 0 where unknown",
            "VALUES_WRONG",
        )


def check_times(times: FloatArray, count: int, subject: str) -> None:
    """Refuse times that are not those of `count` frames, one after the other."""
    if count == 0:
        raise InputError(f"the {subject} has no frames; expected at least one", "TAKE_EMPTY")
    if times.shape != (count,):
        raise InputError(f"the {subject} has {times.size} times for {count} frames", "TIMES_WRONG")
    if not np.isfinite(times).all() or (count > 1 and not (np.diff(times) > 0).all()):
        raise InputError(
            f"the times of the {subject} must be finite and strictly increasing", "TIMES_WRONG"
        )
