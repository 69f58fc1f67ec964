"""Blocks of frames: all frames once, and values that do not depend on the blocks."""

import numpy as np
import pytest

from usdface.numerics import frame_blocks as module
from usdface.numerics.frame_blocks import by_blocks, frame_blocks


@pytest.mark.parametrize("frames", [0, 1, 9, 10, 11, 35])
def test_blocks_cover_all_frames_once(monkeypatch: pytest.MonkeyPatch, frames: int) -> None:
    monkeypatch.setattr(module, "BLOCK", 10)
    covered = [k for block in frame_blocks(frames) for k in range(block.start, block.stop)]
    assert covered == list(range(frames))


@pytest.mark.parametrize("frames", [0, 1, 10, 25])
def test_values_of_blocks_are_those_of_the_whole(
    monkeypatch: pytest.MonkeyPatch, frames: int
) -> None:
    values = np.random.default_rng(0).standard_normal((frames, 3))
    monkeypatch.setattr(module, "BLOCK", 10)
    np.testing.assert_array_equal(by_blocks(frames, lambda at: values[at] ** 2), values**2)
