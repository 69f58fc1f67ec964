from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.binding.candidates import candidate_vertices
from usdface.binding.face_surface import face_surface
from usdface.binding.observations import Observations
from usdface.binding.pose_search import _start_poses, search_pose

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
SURFACE = face_surface(MESH)
AT = np.array(list(WORLD.points.values()))
REST, MOVES = MESH.points[AT], MESH.offsets_at(AT)
COUNT = len(AT)
NAMELESS = Observations(
    REST,
    MOVES,
    np.ones(MOVES.shape[:2], dtype=bool),
    np.ones(COUNT, dtype=bool),
    np.full(COUNT, -1),
    np.full(COUNT, np.nan),
)
NAMED = replace(NAMELESS, heights=10.0 * REST[:, 1])


def upright(linear: np.ndarray) -> bool:
    return bool(np.corrcoef((REST @ linear)[:, 1], REST[:, 1])[0, 1] > 0)


def test_names_say_which_way_up_the_search_starts() -> None:
    """A face that is still below its brows looks the same upside down."""
    candidates = candidate_vertices(SURFACE, 0.1)
    free, named = _start_poses(candidates, NAMELESS), _start_poses(candidates, NAMED)
    assert {upright(linear) for linear in free} == {True, False}
    assert {upright(linear) for linear in named} == {True} and len(named) >= len(free) / 3


@pytest.mark.slow
def test_a_face_in_any_pose_is_found_by_its_names_too() -> None:
    """The performer lies on the floor; what is higher by name is higher on the face."""
    lying = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    turned = replace(NAMED, neutral=REST @ lying, displacements=MOVES @ lying)
    registered = search_pose(SURFACE, turned)
    found = registered.candidates.indices[registered.best.assigned]
    found = MESH.points[SURFACE.vertices[found]]
    assert np.median(np.linalg.norm(found - REST, axis=1)) < 0.012  # less than a cell of the mesh
