from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.blend_shapes.blend_shape import BlendShape
from usdface.face.face_points import face_points

NONE = np.zeros(0, dtype=np.int64)


def test_markers_are_the_face_where_there_are_some() -> None:
    mesh = make_world().rig.meshes[0]
    found = face_points(mesh, np.array([3, 40, -1, 10**6]))
    assert found.vertices.tolist() == [3, 40] and found.shares.tolist() == [0.5, 0.5]


def test_vertices_count_by_how_far_the_blend_shapes_move_them() -> None:
    mesh = make_world().rig.meshes[0]
    far = BlendShape("a", [1, 2, 5], [[0.0, 0.03, 0.0], [0.0, 0.0, 0.01], [0.0, 0.0, 0.0]])
    near = BlendShape("b", [2, 4], [[1e-4, 0.0, 0.0], [1e-9, 0.0, 0.0]])
    found = face_points(replace(mesh, shapes=(far, near)), NONE)
    shares = dict(zip(found.vertices.tolist(), found.shares.tolist(), strict=True))
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares[1] == pytest.approx(0.45) and shares[2] == pytest.approx(0.55)
    assert 5 not in shares and shares[4] < 1e-9


def test_a_shape_of_the_body_counts_as_one_of_many() -> None:
    mesh = make_world().rig.meshes[0]
    body = np.arange(len(mesh.points))
    fat = BlendShape("fat", body, np.full((len(body), 3), 0.1))
    plain, both = (
        face_points(replace(mesh, shapes=s), NONE) for s in (mesh.shapes, (*mesh.shapes, fat))
    )
    others = np.isin(both.vertices, plain.vertices, invert=True)
    assert 0.0 < both.shares[others].sum() <= 1.0 / (len(mesh.shapes) + 1)
    low, high = both.box(mesh.points, 0.05)
    assert (low >= mesh.points.min(axis=0)).all() and (high <= mesh.points.max(axis=0)).all()


def test_shapes_that_move_nothing_are_no_face() -> None:
    mesh = make_world().rig.meshes[0]
    for shapes in ((), (BlendShape("a", [1], [[0.0, 0.0, 0.0]]),)):
        assert len(face_points(replace(mesh, shapes=shapes), NONE).vertices) == 0


def test_the_box_leaves_out_a_share_at_each_side() -> None:
    mesh = make_world().rig.meshes[0]
    found = face_points(mesh, np.arange(100))
    points = np.repeat(np.arange(100.0)[:, None], 3, axis=1)
    low, high = found.box(points, 0.1)
    assert low[0] == pytest.approx(9.0, abs=1.1) and high[2] == pytest.approx(90.0, abs=1.1)
