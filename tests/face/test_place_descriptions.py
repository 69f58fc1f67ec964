import numpy as np
from worlds import make_world

from usdface.face.bound_face import BoundFace
from usdface.face.place_descriptions import place_descriptions

WORLD = make_world(head_moves=False)
FACE = BoundFace(WORLD.rig.face(), tuple(WORLD.points), np.array(list(WORLD.points.values())))


def test_places_are_told_by_region_side_and_the_nearest_marker() -> None:
    left, right = place_descriptions(FACE, FACE.vertices_of(("brow_mid_l", "brow_mid_r")))
    assert left.startswith("left brow, 0 mm from marker brow_mid_l")
    assert right.startswith("right brow")
    nobody, chin = BoundFace(FACE.mesh, (), np.zeros(0, int)), FACE.vertex_of["chin"]
    assert place_descriptions(nobody, np.array([chin])) == (f"middle of the jaw (vertex {chin})",)
