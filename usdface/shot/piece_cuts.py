"""The places where a long take is cut: blocks of the clean-up, pieces of the solve, the sample."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from usdface.arrays import IntArray

__all__ = ["PieceCuts"]

# Frames that are cleaned together, two minutes at 30 Hz, and blocks of a piece: 1 GB while it is
# solved, with 68 markers and 53 blend shapes.
_BLOCK = 4096
_BLOCKS = 4
# Frames around a block by which it is cleaned, 9 s at 30 Hz: longer than most gaps, so that labels
# that change at its end while hidden are seen to come back.
_MARGIN = 256
# Segments of the sample, and frames of each.
_STRETCHES = 16
_STRETCH = 1024


@dataclass(frozen=True, slots=True)
class PieceCuts:
    """The places where a take is cut.

    Attributes
    ----------
    frames : int
        Of the take.
    blocks : tuple of int
        First frames of the blocks of the clean-up, and the end.
    pieces : tuple of int
        The same of the pieces, whose ends are ends of blocks.
    """

    frames: int
    blocks: tuple[int, ...]
    pieces: tuple[int, ...]

    @classmethod
    def of(cls, frames: int) -> "PieceCuts":
        """Return the cuts of a take; its last block has half a block at least."""
        blocks = list(range(0, max(1, frames - _BLOCK // 2), _BLOCK))
        return cls(frames, (*blocks, frames), (*blocks[::_BLOCKS], frames))

    def piece(self, number: int) -> tuple[int, int]:
        """Return first frame and end of a piece."""
        return self.pieces[number], self.pieces[number + 1]

    def __len__(self) -> int:
        """Return the number of pieces."""
        return len(self.pieces) - 1

    def blocks_over(self, first: int, end: int) -> Iterator[tuple[int, int]]:
        """Yield first frame and end of the blocks that frames from `first` to `end` lie in."""
        for start, stop in pairwise(self.blocks):
            if start < end and stop > first:
                yield start, stop

    def around(self, start: int, stop: int) -> tuple[int, int]:
        """Return first frame and end of the frames by which those of blocks are cleaned."""
        return self.reached(start, stop, _MARGIN)

    def reached(self, first: int, end: int, reach: int) -> tuple[int, int]:
        """Return first frame and end of frames with `reach` more on both sides."""
        return max(0, first - reach), min(self.frames, end + reach)

    def sample(self, neutral: tuple[int, int] | None) -> IntArray:
        """Return the frame indices (N,) that estimates come from: stretches, and neutral ones."""
        wanted = np.zeros(self.frames, dtype=bool)
        if self.frames <= _STRETCHES * _STRETCH:
            wanted[:] = True
        for start in np.linspace(0, max(0, self.frames - _STRETCH), _STRETCHES).astype(int):
            wanted[start : start + _STRETCH] = True
        if neutral is not None:
            wanted[neutral[0] : neutral[1] + 1] = True
        return np.flatnonzero(wanted)
