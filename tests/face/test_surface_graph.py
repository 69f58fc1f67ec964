import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components, dijkstra
from skins import LIP, flat_skin, grid, joined_lips

from usdface.face.surface_graph import surface_graph
from usdface.rigs import Mesh


def test_edges_and_diagonals_of_quads_have_their_lengths_once() -> None:
    mesh = flat_skin(columns=5, rows=4)
    graph = surface_graph(mesh)
    a, b = graph.nonzero()
    # 4 rows of 4 edges, 3 of 5, and both diagonals of 12 quads.
    assert len(a) == 4 * 4 + 3 * 5 + 2 * 12
    assert len({frozenset(pair) for pair in zip(a.tolist(), b.tolist(), strict=True)}) == len(a)
    lengths = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    np.testing.assert_allclose(np.asarray(graph[a, b]).ravel(), lengths, rtol=1e-12)


def test_triangles_have_no_diagonals() -> None:
    places, quads = grid(3, 3)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points = np.column_stack([places, np.zeros(9)])
    graph = surface_graph(Mesh("m", points, np.full(8, 3), triangles.ravel()))
    assert graph.nnz == 12 + 4


def test_vertices_split_by_a_seam_are_one() -> None:
    """The right half has vertices of its own along the middle column, as glTF files have."""
    places, quads = grid(5, 4)
    points = 0.01 * np.column_stack([places, np.zeros(len(places))])
    middle = np.flatnonzero(places[:, 0] == 2)
    twin = {int(v): len(points) + k for k, v in enumerate(middle)}
    right = quads[places[quads, 0].min(axis=1) >= 2]
    left = quads[places[quads, 0].min(axis=1) < 2]
    split = np.vectorize(lambda v: twin.get(v, v))(right)
    faces = np.concatenate([left, split])
    torn = Mesh("m", np.vstack([points, points[middle]]), np.full(len(faces), 4), faces.ravel())
    whole = Mesh("m", points, np.full(len(quads), 4), quads.ravel())
    lengths = dijkstra(surface_graph(torn), directed=False)[:20, :20]
    np.testing.assert_allclose(lengths, dijkstra(surface_graph(whole), directed=False), atol=1e-7)


def test_a_shell_that_touches_skin_is_not_joined() -> None:
    """The rim of a small sheet lies on vertices within a large one."""
    places, quads = grid(5, 5)
    points = 0.01 * np.column_stack([places, np.zeros(25)])
    shell = points[[6, 7, 12, 11]]
    faces = np.concatenate([quads, [[25, 26, 27, 28]]])
    mesh = Mesh("m", np.vstack([points, shell]), np.full(len(faces), 4), faces.ravel())
    count, part = connected_components(surface_graph(mesh), directed=False)
    assert count == 2 and (part[:25] == part[0]).all() and (part[25:] == part[25]).all()


@pytest.mark.parametrize("gap", [1e-4, 0.0])
def test_lips_that_touch_are_far_apart_along_the_skin(gap: float) -> None:
    mesh = joined_lips(gap)
    upper, lower = 3 * LIP + 10, 2 * LIP + 10
    assert np.linalg.norm(mesh.points[upper] - mesh.points[lower]) < 2e-4
    length = dijkstra(surface_graph(mesh), directed=False, indices=upper)[lower]
    # To the column of the corner, and back: 9 columns of 2 mm each way.
    assert length == pytest.approx(0.036, rel=0.02)
