import contextlib
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.binding.face_surface import face_surface
from usdface.errors import InputError
from usdface.rigs import BlendShape, Mesh

COLUMNS = 9


def lips(depth: float = 0.0) -> Mesh:
    """Two flat lips, 1 mm apart, joined at both corners only; maybe a pocket behind them."""
    x = np.linspace(-0.04, 0.04, COLUMNS)
    rows = (0.03, 0.0005, -0.0005, -0.03)
    points = np.array([(u, v, 0.0) for v in rows for u in x])
    points[2 * COLUMNS, 1] = points[COLUMNS, 1] = 0.0
    first = np.arange(COLUMNS - 1)
    quads = [np.stack([first, first + 1, first + 1 + COLUMNS, first + COLUMNS], 1)[:, ::-1]]
    quads.append(quads[0] + 2 * COLUMNS)
    # A corner where both lips meet.
    joined = np.concatenate(quads)
    joined[joined == 2 * COLUMNS] = COLUMNS
    if depth:
        back = points.copy()
        back[:, 2] -= depth
        quads = np.concatenate([joined, joined + len(points)])
        points = np.concatenate([points, back])
        joined = quads
    move = np.zeros_like(points)
    move[:, 1] = -0.01
    shape = BlendShape.from_dense("down", move)
    return Mesh("lips", points, np.full(len(joined), 4), joined.ravel(), shapes=(shape,))


def test_lips_that_touch_are_far_apart_along_the_skin() -> None:
    mesh = lips()
    skin = face_surface(mesh)
    upper, lower = 2 * COLUMNS - 2, 3 * COLUMNS - 2
    assert np.linalg.norm(mesh.points[upper] - mesh.points[lower]) < 0.0011
    column = int(np.flatnonzero(skin.vertices == lower)[0])
    # Back to the joined corner, and out again: 7 columns of 10 mm each way.
    assert skin.distances(np.array([upper]))[0, column] == pytest.approx(0.14, rel=0.01)
    assert skin.distances(np.array([upper]), limit=0.05)[0, column] == np.inf


def test_what_lies_behind_the_skin_is_none() -> None:
    mesh = lips(depth=0.03)
    skin = face_surface(mesh)
    assert len(skin.vertices) >= 2 * COLUMNS
    assert skin.vertices.max() < len(mesh.points) // 2


def test_all_of_a_face_is_skin() -> None:
    mesh = make_world().rig.meshes[0]
    np.testing.assert_array_equal(face_surface(mesh).vertices, np.arange(len(mesh.points)))


def test_split_vertices_do_not_tear_the_skin() -> None:
    """A file that gives each face its own vertices has the same distances."""
    mesh = make_world().rig.meshes[0]
    corners = mesh.face_indices
    shapes = tuple(
        BlendShape.from_dense(name, offsets[corners])
        for name, offsets in zip(
            mesh.shape_names, mesh.offsets_at(np.arange(len(mesh.points))), strict=True
        )
    )
    torn = Mesh(
        "torn", mesh.points[corners], mesh.face_counts, np.arange(len(corners)), shapes=shapes
    )
    skin, other = face_surface(mesh), face_surface(torn)
    far = skin.distances(np.array([0]))[0][corners]
    np.testing.assert_allclose(other.distances(np.array([0]))[0], far, atol=1e-6)


def test_a_shell_that_touches_the_skin_is_none() -> None:
    """As over an eye: its rim lies on vertices of the lid, which goes on behind it."""
    mesh = make_world().rig.meshes[0]
    count = len(mesh.points)
    # Two neighbours amid the face.
    a = int(np.linalg.norm(mesh.points - mesh.points.mean(axis=0), axis=1).argmin())
    b = int(mesh.face_indices[np.flatnonzero(mesh.face_indices == a)[0] + 1])
    edge = mesh.points[[a, b]]
    away = np.array([0.0, 0.004, 0.002])
    shell = np.concatenate([edge, edge[::-1] + away])
    turn = np.arange(4)
    if np.cross(shell[1] - shell[0], shell[2] - shell[0])[2] < 0:
        turn = turn[::-1]
    moves = mesh.offsets_at(np.arange(count))
    carried = np.concatenate([moves, np.repeat(moves[:, [a]], 4, axis=1) + 0.01], axis=1)
    shapes = tuple(
        BlendShape.from_dense(name, move)
        for name, move in zip(mesh.shape_names, carried, strict=True)
    )
    more = Mesh(
        "more",
        np.concatenate([mesh.points, shell]),
        np.append(mesh.face_counts, 4),
        np.concatenate([mesh.face_indices, count + turn]),
        shapes=shapes,
    )
    np.testing.assert_array_equal(np.setdiff1d(face_surface(more).vertices, np.arange(count)), [])


def test_a_mesh_that_nothing_moves_has_no_skin() -> None:
    mesh = lips()
    still = Mesh("still", mesh.points, mesh.face_counts, mesh.face_indices)
    with pytest.raises(InputError, match="move nothing"):
        face_surface(still)


def test_a_deep_mesh_of_long_triangles_takes_no_more_memory() -> None:
    """The images are bounded where the face is a thousand times as deep as it is wide."""
    mesh = make_world().rig.meshes[0]
    points = mesh.points * [1.0, 1.0, 1e4]
    tracemalloc.start()
    try:
        with contextlib.suppress(InputError):  # no skin may be seen; that is an answer
            face_surface(replace(mesh, points=points))
        assert tracemalloc.get_traced_memory()[1] < 60e6
    finally:
        tracemalloc.stop()


def test_a_vertex_that_is_torn_off_is_no_skin() -> None:
    mesh = make_world().rig.meshes[0]
    offsets = mesh.offsets_at(np.arange(len(mesh.points)))[0]
    offsets[40] += 0.55
    torn = replace(mesh, shapes=(BlendShape.from_dense("torn", offsets), *mesh.shapes[1:]))
    skin = face_surface(torn)
    assert np.flatnonzero(skin.torn).tolist() == [40]
    np.testing.assert_array_equal(skin.vertices, np.delete(np.arange(len(mesh.points)), 40))
    assert skin.moving.sum() == pytest.approx(face_surface(mesh).moving.sum(), abs=1)
