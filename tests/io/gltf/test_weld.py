import numpy as np

from usdface.io.gltf.weld import rows_at, weld_vertices

NONE = np.zeros(0, int), np.zeros((0, 3))


def test_equal_vertices_become_the_first_of_them() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0], [2, 0, 0], [-0.0, 0, 0]], float)
    first, of_vertex = weld_vertices(points, [], [NONE])
    np.testing.assert_array_equal(first, [0, 1, 3])
    np.testing.assert_array_equal(of_vertex, [0, 1, 0, 2, 0])


def test_one_difference_keeps_vertices_apart() -> None:
    points = np.zeros((3, 3))
    normals = np.array([[0, 0, 1], [0, 0, 1], [0, 1, 0]], float)
    assert len(weld_vertices(points, [normals], [])[0]) == 2
    moved = np.array([1]), np.array([[0, 1e-9, 0]])
    assert len(weld_vertices(points, [normals], [NONE, moved])[0]) == 3


def test_welding_restores_any_split() -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(200, 3))
    indices = np.sort(rng.choice(200, 60, replace=False))
    offsets = rng.normal(size=(60, 3))
    source = np.concatenate([np.arange(200), rng.integers(0, 200, 500)])
    dense = np.zeros((200, 3))
    dense[indices] = offsets
    rows = np.flatnonzero(dense[source].any(axis=1))
    first, of_vertex = weld_vertices(points[source], [], [(rows, dense[source][rows])])
    np.testing.assert_array_equal(source[first], np.arange(200))
    np.testing.assert_array_equal(of_vertex, source)


def test_rows_at() -> None:
    found = rows_at(np.array([3, 0, 3, 9]), np.array([3, 5]), np.array([[1.0, 2, 3], [4, 5, 6]]))
    np.testing.assert_array_equal(found, [[1, 2, 3], [0, 0, 0], [1, 2, 3], [0, 0, 0]])
    assert not rows_at(np.array([1, 2]), *NONE).any()
