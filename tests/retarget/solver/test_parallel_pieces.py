import numpy as np
import pytest
from bands import dense

from usdface.retarget.solver import parallel_pieces
from usdface.retarget.solver.curvature import curvature_bands
from usdface.retarget.solver.parallel_pieces import overlap, pieces

UNIT = np.eye(4)


def test_pieces_cover_the_take_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel_pieces, "_PIECE", 50)
    bands = curvature_bands(np.arange(1200) / 60) * 0.04 / 27.0
    for frames in (1, 50, 51, 1199):
        found = pieces(frames, 9 * UNIT, 0.5 * np.ones(4), UNIT, bands[:, :frames], 100)
        covered = np.concatenate([np.arange(frames)[core] for core, _ in found])
        np.testing.assert_array_equal(covered, np.arange(frames))
        assert all(w.start <= c.start < c.stop <= w.stop for c, w in found)


def test_the_overlap_reaches_as_far_as_anything_is_felt_and_not_much_further() -> None:
    """A single unbounded weight: what is felt of a frame is a row of the inverse."""
    rng = np.random.default_rng(0)
    for times in (np.arange(1000) / 60, np.cumsum(rng.uniform(0.005, 0.05, 1000))):
        bands = curvature_bands(times) * 1e-5
        reach = overlap(np.eye(1), np.ones(1), np.eye(1), bands, 10**6)
        felt = np.abs(np.linalg.inv(np.eye(1000) + dense(bands)))[500]
        felt /= felt[500]
        assert felt[: 500 - reach + 1].max() < 1e-7 and felt[500 + reach :].max() < 1e-7
        assert felt[500 + reach // 8] > 1e-7 or np.ptp(np.diff(times)) > 1e-9
