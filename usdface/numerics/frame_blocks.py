"""Frames in blocks: where values of all markers of a long take at once would not fit in memory."""

from collections.abc import Callable, Iterator

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["BLOCK", "by_blocks", "frame_blocks"]

# Frames: an array of 68 markers has 7 MB. Results do not depend on it.
BLOCK = 4096


def frame_blocks(frames: int, size: int = 0) -> Iterator[slice]:
    """Yield consecutive blocks that cover so many frames; one, empty, for none."""
    size = size or BLOCK
    for first in range(0, max(frames, 1), size):
        yield slice(first, min(first + size, frames))


def by_blocks(frames: int, compute: Callable[[slice], FloatArray], size: int = 0) -> FloatArray:
    """Return the values (F, ...) of all frames, computed block by block.

    Parameters
    ----------
    frames : int
    compute : callable
        Returns the values of a block, each frame's by that frame alone.
    size : int
        Frames of a block, where a frame has more than its markers; 0 = `BLOCK`.
    """
    result: FloatArray | None = None
    for block in frame_blocks(frames, size):
        part = compute(block)
        if block.stop - block.start == frames:
            return part
        if result is None:
            result = np.empty((frames, *part.shape[1:]))
        result[block] = part
    assert result is not None
    return result
