"""Areas around vertices add up to the surface, and follow its size alone."""

import numpy as np

from usdface.geometry.vertex_areas import vertex_areas

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [7, 7, 7.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_each_vertex_has_a_third_of_its_triangles() -> None:
    np.testing.assert_allclose(vertex_areas(SQUARE, HALVES), [1 / 3, 1 / 6, 1 / 3, 1 / 6, 0])
    assert not vertex_areas(SQUARE, HALVES[:0]).any()


def test_areas_grow_with_the_square_of_the_size_and_not_with_the_pose() -> None:
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    areas = vertex_areas(SQUARE, HALVES)
    np.testing.assert_allclose(vertex_areas(0.1 * SQUARE @ turn + 5.0, HALVES), 0.01 * areas)


def test_a_finer_mesh_has_the_same_area() -> None:
    points = np.concatenate([SQUARE, [[0.5, 0.5, 0.0]]])
    quarters = np.array([[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 0, 5]])
    np.testing.assert_allclose(vertex_areas(points, quarters)[-1], 1 / 3)
    np.testing.assert_allclose(vertex_areas(points, quarters).sum(), 1.0)
