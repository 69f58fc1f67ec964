import numpy as np
from curved_world import make_curved_world

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.dot_skin import dot_skin
from usdface.retarget.bound_points import BoundPoints

MESH = make_curved_world().rig.meshes[0]
VERTICES = np.arange(0, len(MESH.points), 5)
SKIN = dot_skin(MESH, VERTICES, np.full(len(VERTICES), np.nan))


def test_points_of_markers_without_a_dot_are_their_vertices() -> None:
    bound = BoundPoints.on_skin(SKIN, MESH.shape_names)
    np.testing.assert_allclose(bound.rest, MESH.points[VERTICES], atol=1e-15)
    np.testing.assert_allclose(bound.offsets, MESH.offsets_at(VERTICES), atol=1e-15)


def test_some_points_move_as_they_did() -> None:
    model, _ = evaluator_of(MESH.shapes, VERTICES)
    some = BoundPoints(MESH.points[VERTICES], MESH.shape_names, model).select(np.array([3, 1]))
    weights = model.complete(np.random.default_rng(0).random((2, len(model.free))))
    expected = model.displacements(weights).reshape(2, -1, 3)[:, [3, 1]]
    np.testing.assert_array_equal(some.model.displacements(weights).reshape(2, -1, 3), expected)
    np.testing.assert_array_equal(some.rest, MESH.points[VERTICES[[3, 1]]])


def test_linear_points_move_by_their_offsets() -> None:
    offsets = MESH.offsets_at(VERTICES)
    bound = BoundPoints.linear(MESH.points[VERTICES], offsets, MESH.shape_names)
    np.testing.assert_array_equal(bound.offsets, offsets)
    assert bound.model.linear
