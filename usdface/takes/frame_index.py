"""Frames of a take by index and by time."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.takes.take_axes import frame_step

__all__ = ["check_frame", "frame_at"]


def check_frame(times: FloatArray, index: int) -> None:
    """Refuse the index of a frame that a take with `times` (F,) [s] does not have.

    Raises
    ------
    InputError
    """
    if not 0 <= index < len(times):
        raise InputError(f"there is no frame {index}; the take has frames 0 to {len(times) - 1}")


def frame_at(times: FloatArray, seconds: float) -> int:
    """Return the frame nearest to a time, of a take with `times` (F,) [s].

    Raises
    ------
    InputError
        If the time lies outside the take by more than half a frame.
    """
    first, last = float(times[0]), float(times[-1])
    slack = frame_step(times) / 2
    if not first - slack <= seconds <= last + slack:
        raise InputError(
            f"there is no frame at {seconds:g} s; the take goes from {first:g} to {last:g} s"
        )
    return int(np.abs(times - seconds).argmin())
