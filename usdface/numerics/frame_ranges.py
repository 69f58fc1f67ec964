"""Ranges of frames in which something holds."""

import numpy as np

from usdface.arrays import BoolArray

__all__ = ["frame_ranges"]


def frame_ranges(where: BoolArray) -> list[tuple[int, int]]:
    """Return first and last frame of each run of True in `where` (F,)."""
    change = np.diff(np.concatenate([[False], where, [False]]).astype(np.int8))
    firsts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    return list(zip(firsts.tolist(), (ends - 1).tolist(), strict=True))
