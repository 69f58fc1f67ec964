import numpy as np

from usdface.geometry.face_corners import next_corners


def test_the_last_corner_of_a_face_is_followed_by_its_first() -> None:
    assert next_corners(np.array([3, 4])).tolist() == [1, 2, 0, 4, 5, 6, 3]


def test_faces_without_corners_are_passed_by() -> None:
    assert next_corners(np.array([0, 3, 0])).tolist() == [1, 2, 0]
    assert not len(next_corners(np.zeros(0, np.int64)))
