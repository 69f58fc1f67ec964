import numpy as np

from usdface.geometry.vertex_normals import (
    NormalsNear,
    normals_of_faces,
    unit_or_up,
    unit_or_zero,
    vertex_normals,
)

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])


def test_a_cubes_corners_point_outwards():
    normals = vertex_normals(CUBE, np.full(6, 4), SIDES)
    np.testing.assert_allclose(normals, CUBE / np.sqrt(3))


def test_normals_turn_with_the_mesh_and_ignore_place_and_size():
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    points = CUBE + rng.normal(0, 0.1, CUBE.shape)
    normals = vertex_normals(points, np.full(6, 4), SIDES)
    moved = vertex_normals(1e-3 * points @ turn + 10.0, np.full(6, 4), SIDES)
    np.testing.assert_allclose(moved, normals @ turn, atol=1e-9)


def test_splitting_a_flat_polygon_changes_nothing():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1.0]])
    whole = vertex_normals(square, np.array([4]), np.arange(4))
    split = vertex_normals(square, np.array([3, 3]), np.array([0, 1, 2, 0, 2, 3]))
    np.testing.assert_allclose(whole, split)
    np.testing.assert_allclose(whole, [[0, 1, 0]] * 4)


def test_what_has_no_normal_points_up_in_files_and_is_zero_elsewhere():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5.0]])
    faces = np.array([3, 0]), np.array([0, 1, 2])
    np.testing.assert_array_equal(normals_of_faces(*faces, 4)(points), [[0, 1, 0]] * 4)
    np.testing.assert_array_equal(vertex_normals(points, *faces), np.zeros((4, 3)))


def test_only_what_has_no_direction_differs():
    vectors = np.array([[3.0, 0, 4], [0, 0, 0]])
    np.testing.assert_allclose(unit_or_up(vectors), [[0.6, 0, 0.8], [0, 1, 0]])
    np.testing.assert_allclose(unit_or_zero(vectors), [[0.6, 0, 0.8], [0, 0, 0]])


def test_faces_are_prepared_once_for_many_poses():
    normals_at = normals_of_faces(np.full(6, 4), SIDES, 8)
    for size in (1, 2):
        np.testing.assert_allclose(normals_at(size * CUBE), CUBE / np.sqrt(3))


def test_normals_near_some_vertices_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(5)
    counts = rng.integers(3, 6, 40)
    corners = rng.integers(0, 30, counts.sum())  # of 33: three have no face
    points = rng.normal(size=(33, 3))
    near, whole = NormalsNear(counts, corners, 33), normals_of_faces(counts, corners, 33)
    for vertices in (np.arange(33), np.array([4, 31]), np.array([32]), np.zeros(0, np.int64)):
        np.testing.assert_allclose(near.at(points, vertices), whole(points)[vertices], atol=1e-12)
    moved = points.copy()
    moved[7] += 1.0
    changed = np.flatnonzero((whole(moved) != whole(points)).any(axis=1))
    assert set(changed) <= set(near.ring(np.array([7])))
