import numpy as np
import pytest
from worlds import make_world

from usdface.binding.observations import Observations

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
AT = np.array(list(WORLD.points.values()))
REST, MOVES = MESH.points[AT], MESH.offsets_at(AT)


def observed(points: np.ndarray, moves: np.ndarray) -> Observations:
    count = len(points)
    seen = np.ones(moves.shape[:2], dtype=bool)
    return Observations(points, moves, seen, np.full(count, -1), np.full(count, np.nan))


def test_where_nothing_moves_all_central_markers_count() -> None:
    still = observed(REST, np.zeros_like(MOVES))
    np.testing.assert_array_equal(still.moving, still.central)


def test_the_spread_is_of_the_unit_of_the_markers_wherever_they_are() -> None:
    spread = observed(REST, MOVES).spread
    assert observed(2 * REST + 0.3, 2 * MOVES).spread == pytest.approx(2 * spread)
