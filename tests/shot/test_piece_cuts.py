import numpy as np
import pytest

from usdface.shot import piece_cuts
from usdface.shot.piece_cuts import PieceCuts

LENGTHS = (1, 63, 64, 65, 128, 191, 192, 193, 1500, 5000)


@pytest.fixture(autouse=True)
def short_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("BLOCK", 128), ("BLOCKS", 3), ("STRETCH", 24), ("STRETCHES", 6)):
        monkeypatch.setattr(piece_cuts, f"_{name}", value)


@pytest.mark.parametrize("frames", LENGTHS)
def test_cuts_cover_the_take_and_do_not_part_a_block(frames: int) -> None:
    cuts = PieceCuts.of(frames)
    assert cuts.pieces[0] == cuts.blocks[0] == 0
    assert cuts.pieces[-1] == cuts.blocks[-1] == frames
    assert set(cuts.pieces) <= set(cuts.blocks)
    assert (np.diff(cuts.blocks) > 0).all() and np.diff(cuts.blocks).max() < 2 * 128


def test_frames_lie_in_the_blocks_that_hold_one_of_them() -> None:
    cuts = PieceCuts.of(500)
    assert cuts.blocks == (0, 128, 256, 384, 500) and cuts.pieces == (0, 384, 500)
    assert len(cuts) == 2 and cuts.piece(1) == (384, 500)
    for first, end, blocks in [
        (128, 256, [1]),
        (127, 257, [0, 1, 2]),
        (0, 1, [0]),
        (499, 500, [3]),
    ]:
        assert list(cuts.blocks_over(first, end)) == [cuts.blocks[k : k + 2] for k in blocks]


@pytest.mark.parametrize("frames", LENGTHS)
def test_the_sample_ascends_to_the_end_and_has_the_neutral_frames(frames: int) -> None:
    neutral = min(3, frames - 1), min(40, frames - 1)
    sample = PieceCuts.of(frames).sample(neutral)
    assert (np.diff(sample) > 0).all() and sample[-1] == frames - 1
    assert set(range(neutral[0], neutral[1] + 1)) <= set(sample.tolist())


def test_frames_beyond_the_ends_of_the_take_are_not_reached() -> None:
    cuts = PieceCuts.of(1000)
    assert cuts.reached(100, 200, 50) == (50, 250)
    assert cuts.reached(20, 990, 50) == (0, 1000)
