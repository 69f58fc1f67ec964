import numpy as np
import pytest
from deformed import deformed

from usdface.blend_shapes.blend_shape import Inbetween
from usdface.geometry.bake_transform import bake_transform
from usdface.rigs import BlendShape, Mesh


def test_placing_commutes_with_deforming() -> None:
    rng = np.random.default_rng(6)
    points = rng.normal(size=(6, 3))
    shape = BlendShape("s", [1, 4], rng.normal(size=(2, 3)))
    mesh = Mesh("m", points, [3, 3], [0, 1, 2, 3, 4, 5], shapes=(shape,))
    matrix = np.eye(4)
    matrix[:, :3] = rng.normal(size=(4, 3))
    weights = np.array([0.7])
    moved = np.c_[deformed(mesh, weights), np.ones(6)] @ matrix
    np.testing.assert_allclose(deformed(bake_transform(mesh, matrix), weights), moved[:, :3])


def test_an_inbetween_goes_as_its_blend_shape() -> None:
    rng = np.random.default_rng(7)
    offsets, normal_offsets = rng.normal(size=(2, 1, 3))
    between = Inbetween("half", 0.5, offsets, normal_offsets)
    shape = BlendShape("s", [1], offsets, normal_offsets, inbetweens=(between,))
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], np.eye(3), shapes=(shape,))
    matrix = np.eye(4)
    matrix[:, :3] = rng.normal(size=(4, 3))
    (out,) = bake_transform(mesh, matrix).shapes
    np.testing.assert_array_equal(out.inbetweens[0].offsets, out.offsets)
    np.testing.assert_array_equal(out.inbetweens[0].normal_offsets, out.normal_offsets)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_normals_stay_perpendicular_and_outside(mirror: float) -> None:
    rng = np.random.default_rng(8)
    points = rng.normal(size=(3, 3))
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    normals = np.tile(normal / np.linalg.norm(normal), (3, 1))
    uvs = rng.random((3, 2))
    mesh = Mesh("m", points, [3], [0, 1, 2], normals, uvs)
    matrix = np.diag([mirror, 2.0, 0.5, 1.0])
    out = bake_transform(mesh, matrix)
    a, b, c = out.points[out.face_indices]
    area = np.cross(b - a, c - a)
    np.testing.assert_allclose(out.normals, np.tile(area / np.linalg.norm(area), (3, 1)))
    np.testing.assert_array_equal(out.uvs[np.argsort(out.face_indices)], uvs)


def test_normal_offsets_follow_a_rotation_and_ignore_uniform_scale() -> None:
    shape = BlendShape("s", [0], [[0, 0, 1.0]], [[0, 0.5, 0]])
    up = np.tile([0, 0, 1.0], (3, 1))
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], up, shapes=(shape,))
    matrix = np.eye(4)
    matrix[:3, :3] = 10 * np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # y to -x
    out = bake_transform(mesh, matrix).shapes[0]
    np.testing.assert_allclose(out.offsets, [[0, 0, 10]])
    np.testing.assert_allclose(out.normal_offsets, [[-0.5, 0, 0]], atol=1e-15)


def test_a_flattened_mesh_has_no_normals() -> None:
    shape = BlendShape("s", [0], [[0, 0, 1.0]], [[0, 0.5, 0]])
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], np.eye(3), shapes=(shape,))
    out = bake_transform(mesh, np.diag([1.0, 1, 0, 1]))
    assert out.normals is None
    assert out.shapes[0].normal_offsets is None
