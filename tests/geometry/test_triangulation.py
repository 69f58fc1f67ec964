import numpy as np
import pytest

from usdface.geometry.triangulation import triangle_fans, triangulated


def areas(points: np.ndarray, indices: np.ndarray, corners: np.ndarray) -> np.ndarray:
    a, b, c = points[indices[corners]].swapaxes(0, 1)
    return np.cross(b - a, c - a)[:, 2] / 2


L_SHAPE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
ARROW = [(0, 0), (2, -1), (0.5, 0), (2, 1)]  # a fan around the first corner lies inside
CHEVRON = [(2, -1), (0.5, 0), (2, 1), (0, 0)]  # ... around this one it does not
COMB = [(0, 0), (6, 0), (6, 3), (5, 1), (4, 3), (3, 1), (2, 3), (1, 1), (0, 3)]
SPIRAL = [(0, 0), (5, 0), (5, 5), (1, 5), (1, 2), (3, 2), (3, 3), (2, 3), (2, 4), (4, 4), (4, 1)]
SPIRAL += [(0, 1)]


@pytest.mark.parametrize("outline", [L_SHAPE, ARROW, CHEVRON, COMB, SPIRAL])
@pytest.mark.parametrize("shift", range(4))
def test_triangles_fill_a_concave_face_once(outline, shift: int) -> None:
    points = np.roll(np.array([(x, y, 0.0) for x, y in outline]), shift, axis=0)
    indices = np.arange(len(points))
    corners, faces = triangulated(np.array([len(points)]), indices, points)
    assert len(corners) == len(points) - 2 and not faces.any()
    x, y, _ = points.T
    area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    parts = areas(points, indices, corners) * np.sign(area)
    assert (parts > 0).all()
    assert parts.sum() == pytest.approx(abs(area))


def test_convex_faces_are_fans() -> None:
    counts = np.array([3, 5, 0, 2, 4])
    angles = np.concatenate([np.arange(n) / max(n, 1) for n in counts]) * 2 * np.pi
    points = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    corners, faces = triangulated(counts, np.arange(14), points)
    expected = [[0, 1, 2], [3, 4, 5], [3, 5, 6], [3, 6, 7], [10, 11, 12], [10, 12, 13]]
    assert corners.tolist() == expected
    assert faces.tolist() == [0, 1, 1, 1, 4, 4]


def test_the_winding_is_kept_and_other_faces_are_fans() -> None:
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)])
    arrow = np.array([(x, y, 0.0) for x, y in CHEVRON[::-1]]) + 5
    points = np.concatenate([square, arrow])
    corners, faces = triangulated(np.array([4, 4, 3]), np.array([*range(8), 0, 1, 2]), points)
    assert corners[[0, 1, 4]].tolist() == [[0, 1, 2], [0, 2, 3], [8, 9, 10]]
    assert faces.tolist() == [0, 0, 1, 1, 2]
    assert len(set(np.sign(areas(points, np.arange(8), corners[2:4])))) == 1


def test_what_crosses_itself_or_has_no_area_is_a_fan() -> None:
    bow = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0.0)])
    for points in (bow, np.zeros((4, 3))):
        corners, _ = triangulated(np.array([4]), np.arange(4), points)
        assert len(corners) == 2


def test_faces_become_fans_of_their_first_corner() -> None:
    indices = np.array([0, 1, 2, 4, 3, 2, 1, 0, 1, 2, 3, 4])
    corners, faces = triangle_fans(np.array([3, 4, 5]))
    expected = [[0, 1, 2], [4, 3, 2], [4, 2, 1], [0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert indices[corners].tolist() == expected and faces.tolist() == [0, 1, 1, 2, 2, 2]
