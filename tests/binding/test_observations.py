import numpy as np
import pytest
from worlds import make_world

from usdface.binding.observations import Observations, observe

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
AT = np.array(list(WORLD.points.values()))
REST, MOVES = MESH.points[AT], MESH.offsets_at(AT)


def observed(points: np.ndarray, moves: np.ndarray) -> Observations:
    count = len(points)
    visible, seen = np.ones(moves.shape[:2], dtype=bool), np.ones(count, dtype=bool)
    nowhere = np.full(count, np.nan)
    return Observations(points, moves, visible, seen, np.full(count, -1), nowhere)


def test_where_nothing_moves_all_central_markers_count() -> None:
    still = observed(REST, np.zeros_like(MOVES))
    np.testing.assert_array_equal(still.moving, still.central)


def test_the_spread_is_of_the_unit_of_the_markers_wherever_they_are() -> None:
    spread = observed(REST, MOVES).spread
    assert observed(2 * REST + 0.3, 2 * MOVES).spread == pytest.approx(2 * spread)


def test_markers_that_no_neutral_frame_shows_are_told() -> None:
    positions = np.repeat(REST[None], 6, axis=0)
    positions[:3, 1] = np.nan
    positions[4:, 2] = np.nan
    count = len(REST)
    found = observe(
        positions,
        (0, 2),
        np.array([3, 5]),
        anchors=np.full(count, -1),
        heights=np.full(count, np.nan),
    )
    assert np.flatnonzero(~found.seen).tolist() == [1]
    assert np.argwhere(~found.visible).tolist() == [[1, 2]]
    np.testing.assert_allclose(found.neutral, REST)
