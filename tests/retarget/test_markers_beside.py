import numpy as np

from usdface.retarget.markers_beside import markers_beside

POINTS = 0.05 * np.random.default_rng(1).normal(size=(5, 3))
NAMES = ("brow", "lid", "nose", "lip", "chin")


def test_the_marker_that_is_farthest_from_its_vertex_is_named() -> None:
    shifts = np.zeros((5, 3))
    shifts[2, 0], shifts[3, 1] = 0.001, -0.006
    (found,) = markers_beside(shifts, POINTS, NAMES, "take.csv")
    assert (found.code, found.where) == ("MARKER_BESIDE", "take.csv")
    assert "lip 6.0 mm" in found.message and "0.0 mm from their vertices" in found.message


def test_less_than_a_millimetre_on_a_face_is_not_reported() -> None:
    assert markers_beside(np.full((5, 3), 0.0005), POINTS, NAMES, "take.csv") == []
