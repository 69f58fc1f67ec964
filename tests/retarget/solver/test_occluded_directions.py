"""Directions that occluded coordinates decide: exact, found once, and bounded in memory."""

import numpy as np
import pytest

from usdface.arrays import BoolArray, FloatArray
from usdface.retarget.solver import occluded_directions
from usdface.retarget.solver.occluded_directions import OccludedDirections


def a_space() -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return a basis of 18 of 24 dimensions, what 60 frames show of these, and points of it."""
    rng = np.random.default_rng(8)
    basis = np.linalg.qr(rng.normal(size=(24, 18)))[0]
    seen = np.repeat(rng.random((60, 8)) > 0.3, 3, axis=1)
    return basis, seen, rng.normal(size=(60, 18))


def test_what_is_left_of_a_frame_is_beyond_its_occluded_directions() -> None:
    basis, seen, rest = a_space()
    sums, count = OccludedDirections.of(basis, seen).squares(rest)
    for frame in range(60):
        occluded = basis[~seen[frame]].T
        left = rest[frame] - occluded @ np.linalg.lstsq(occluded, rest[frame], rcond=None)[0]
        rank = np.linalg.matrix_rank(occluded) if occluded.size else 0  # NumPy 1.26 wants a value
        assert count[frame] == 18 - rank
        assert sums[frame] == pytest.approx(left @ left, abs=1e-12)


@pytest.mark.parametrize("leak", [0.0, 1e-8, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("occluded", [4, 9, 20])
def test_directions_below_the_rounding_of_a_file_are_none(leak: float, occluded: int) -> None:
    """As by singular values, where three of the occluded coordinates are explained nearly."""
    rng = np.random.default_rng(9)
    explained = np.concatenate([np.eye(24)[:3], rng.normal(size=(3, 24))])
    explained[:3, 3:] = leak * rng.normal(size=(3, 21))
    basis = np.linalg.qr(explained.T, mode="complete")[0][:, 6:]
    seen = (np.arange(24) >= occluded)[None]
    rest = rng.normal(size=(1, 18))
    sums, count = OccludedDirections.of(basis, seen).squares(rest)
    directions, sizes, _ = np.linalg.svd(basis[~seen[0]].T)
    rank = int((sizes > 1e-5).sum())
    left = rest @ directions[:, rank:]
    assert count == [18 - rank]
    np.testing.assert_allclose(sums, (left**2).sum(axis=1), rtol=1e-9)


def test_clear_directions_need_no_singular_values(monkeypatch: pytest.MonkeyPatch) -> None:
    basis, seen, rest = a_space()
    basis[:3] = 0.0  # explained
    expected = OccludedDirections.of(basis, seen).squares(rest)
    monkeypatch.setattr(np.linalg, "svd", None)
    for found, known in zip(
        OccludedDirections.of(basis, seen).squares(rest), expected, strict=True
    ):
        np.testing.assert_array_equal(found, known)


def test_directions_are_found_once_as_far_as_memory_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    basis, seen, rest = a_space()
    kept = OccludedDirections.of(basis, seen)
    monkeypatch.setattr(occluded_directions, "_KEPT", 1000)
    found_again = OccludedDirections.of(basis, seen)
    assert kept.kept is not None and found_again.kept is None
    for one, two in zip(kept.squares(rest), found_again.squares(rest), strict=True):
        np.testing.assert_array_equal(one, two)
