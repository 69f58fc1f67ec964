import numpy as np
from worlds import make_world

from usdface.binding.candidates import candidate_vertices
from usdface.binding.face_surface import face_surface
from usdface.binding.observations import Observations
from usdface.binding.registration import expected_scale

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
CANDIDATES = candidate_vertices(face_surface(MESH))


def observed(points: np.ndarray, moves: np.ndarray) -> Observations:
    count = len(points)
    visible, seen = np.ones(moves.shape[:2], dtype=bool), np.ones(count, dtype=bool)
    nowhere = np.full(count, np.nan)
    return Observations(points, moves, visible, seen, np.full(count, -1), nowhere)


AT = np.array(list(WORLD.points.values()))
REST, MOVES = MESH.points[AT], MESH.offsets_at(AT)


def test_markers_that_hardly_move_do_not_make_the_face_larger() -> None:
    """As those on a neck: the size compared with is that of the skin that moves."""
    neck = REST.mean(axis=0) + 0.12 * np.array([[-0.7, -1, 0], [0, -1, 0], [0.7, -1, 0]])
    points = np.concatenate([REST, neck])
    moves = np.concatenate([MOVES, np.full((len(MOVES), 3, 3), 1e-4)], axis=1)
    with_neck = observed(points, moves)
    assert with_neck.central.all()
    assert expected_scale(CANDIDATES, with_neck) == expected_scale(
        CANDIDATES, observed(REST, MOVES)
    )


def test_the_scale_is_that_of_the_performer_whatever_one_marker_does() -> None:
    scale = expected_scale(CANDIDATES, observed(REST, MOVES))
    doubled = expected_scale(CANDIDATES, observed(2 * REST, 2 * MOVES))
    np.testing.assert_allclose(doubled, scale / 2)
    jumping = MOVES.copy()
    jumping[3, 2] += 0.3
    np.testing.assert_allclose(expected_scale(CANDIDATES, observed(REST, jumping)), scale, rtol=0.1)
