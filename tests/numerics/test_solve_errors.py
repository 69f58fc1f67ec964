"""Numbers that determine nothing are an error of ours."""

import numpy as np
import pytest

from usdface.errors import InputError, SolveError
from usdface.io.takes.files import read_take
from usdface.numerics.solve_errors import solve_errors
from usdface.takes import FARTHEST, MarkerTake, WeightsTake, check_range


def test_a_matrix_that_is_not_positive_definite() -> None:
    @solve_errors()
    def solve() -> None:
        np.linalg.cholesky(-np.eye(2))

    with pytest.raises(SolveError, match="far off"):
        solve()


def test_markers_beyond_any_volume() -> None:
    positions = np.zeros((2, 1, 3))
    positions[1] = 2 * FARTHEST
    with pytest.raises(InputError, match="beyond 100 km"):
        check_range(MarkerTake(("a",), np.arange(2.0), positions))


def test_weights_beyond_any_meaning() -> None:
    with pytest.raises(InputError, match="up to 1e\\+30"):
        check_range(WeightsTake(("a",), np.arange(2.0), np.array([[0.0], [1e30]])))


def test_a_reader_takes_far_places_as_occluded(tmp_path) -> None:
    path = tmp_path / "take.csv"
    path.write_text("time,a_x,a_y,a_z\n0,1,2,3\n0.1,1,1e300,3\n0.2,1,2,3\n")
    take, findings = read_take(path)
    assert np.isnan(take.positions[1]).all() and np.isfinite(take.positions[0]).all()
    assert "MARKER_SPIKE" in [found.code for found in findings]
