from dataclasses import replace

import numpy as np
from curved_world import COMBINED, make_curved_world
from few_shapes import few_shapes
from pxr import Usd, UsdSkel

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import Combination

RNG = np.random.default_rng(2)
MESH = make_curved_world().rig.meshes[0]
POINTS = np.arange(0, len(MESH.points), 7)
MODEL, _ = evaluator_of(MESH.shapes, POINTS)


def test_it_shows_what_usdskel_shows(tmp_path) -> None:
    write_rig(make_curved_world().rig, tmp_path / "rig.usda")
    stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    prim = next(p for p in stage.Traverse() if p.GetTypeName() == "Mesh")
    query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
    for row in RNG.uniform(-0.2, 1.2, size=(8, len(MESH.shapes))):
        points = prim.GetAttribute("points").Get()
        parts = query.ComputeSubShapeWeights(row.tolist())
        tables = query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets()
        assert query.ComputeDeformedPoints(*parts, *tables, points)
        ours = MESH.points[POINTS] + MODEL.displacements(row[None]).reshape(-1, 3)
        np.testing.assert_allclose(ours, np.array(points)[POINTS], atol=1e-7)


def test_combinations_follow_their_parents() -> None:
    free = RNG.random((5, len(MODEL.free)))
    full = dict(zip(MESH.shape_names, MODEL.complete(free).T, strict=True))
    np.testing.assert_allclose(full["smileOpenLeft"], full["jawOpen"] * full["mouthSmileLeft"])
    least = np.minimum(full["browDownLeft"], full["browInnerUp"])
    np.testing.assert_allclose(full["browsWorried"], least)
    assert len(MODEL.free) == len(MESH.shapes) - len(COMBINED)


def test_the_gradient_is_the_derivative() -> None:
    free, forces = RNG.random((4, len(MODEL.free))), RNG.normal(size=(4, 3 * len(POINTS)))
    found = MODEL.gradient(MODEL.complete(free), forces)
    step = 1e-6
    for column in range(len(MODEL.free)):
        ahead, behind = free.copy(), free.copy()
        ahead[:, column] += step
        behind[:, column] -= step
        moved = MODEL.displacements(MODEL.complete(ahead)) - MODEL.displacements(
            MODEL.complete(behind)
        )
        expected = (moved / (2 * step) * forces).sum(axis=1)
        np.testing.assert_allclose(found[:, column], expected, atol=1e-7)


def test_a_combination_of_a_combination() -> None:
    model, found = few_shapes(c=Combination(("a", "d")), d=Combination(("a", "b"), "min"))
    assert found == [] and model.free.tolist() == [0, 1]
    np.testing.assert_allclose(model.complete(np.array([[0.5, 0.4]])), [[0.5, 0.4, 0.2, 0.4]])
    force = np.array([[0.0, 1.0, 0.0]])
    # c = a min(a, b): its slopes are 0.4 for a and 0.5 for b, where b is the least.
    gradient = model.gradient(model.complete(np.array([[0.5, 0.4]])), force)
    np.testing.assert_allclose(gradient, [[0.01 * 1.4, 0.01 * 2.5]])


def test_weights_move_what_their_inbetweens_and_combinations_move() -> None:
    model, _ = few_shapes(c=Combination(("a", "d")), d=Combination(("a", "b"), "min"))
    still = np.zeros_like(model.offsets)
    still[2] = model.offsets[2]  # c alone, which a and, through d, b drive
    assert replace(model, offsets=still).moving.tolist() == [True, True, False, False]
    path = InbetweenPath(1, np.array([0.0, 0.5, 1.0]), np.array([[0.0], [0.01], [0.0]]))
    back = BlendShapeEvaluator(np.zeros((2, 1)), (path,))
    assert back.moving.tolist() == [False, True]


def test_limits_are_rows_of_the_free_weights() -> None:
    model, found = few_shapes(d=Combination(("a", "b"), "limit"), b=Combination(("a", "c")))
    assert found == [] and model.free.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(
        model.limit_rows, [[-1.0, 0.0, 1.0]]
    )  # d <= a; b has no own weight


def test_secants_give_the_change_along_a_segment_exactly() -> None:
    start, end = (MODEL.complete(RNG.random((6, len(MODEL.free)))) for _ in range(2))
    end[:, :3] = start[:, :3]  # a weight that stays has the slope of its path
    end = MODEL.combined(end)
    slopes = MODEL.secants(start, end)
    change = np.einsum("fp,fpn->fn", (end - start)[:, MODEL.free], slopes)
    expected = MODEL.displacements(end) - MODEL.displacements(start)
    np.testing.assert_allclose(change, expected, atol=1e-12)
    here = MODEL.secants(start, start)
    forces = RNG.normal(size=expected.shape)
    tangent = np.einsum("fpn,fn->fp", here, forces)
    np.testing.assert_allclose(tangent, MODEL.gradient(start, forces), atol=1e-12)


def test_weights_in_another_order_show_the_same() -> None:
    names = list(MESH.shape_names)
    order = [*RNG.permutation(len(names)).tolist(), -1]
    weights = MODEL.complete(RNG.random((4, len(MODEL.free))))
    other = np.append(weights, RNG.random((4, 1)), axis=1)[:, order]
    moved = MODEL.reordered(np.array(order))
    expected = MODEL.displacements(weights)
    np.testing.assert_allclose(moved.displacements(other), expected, atol=1e-15)
    np.testing.assert_allclose(moved.combined(other), other)


def test_a_combination_that_lacks_a_parent_stays_still() -> None:
    model, _ = few_shapes(c=Combination(("a", "b")), d=Combination(("c", "a")))
    moved = model.reordered(np.array([0, 2, 3]))  # without b, whose weight is 0
    assert moved.linear and moved.offsets[:, 1].tolist() == [0.01, 0.0, 0.0]


def test_a_linear_function_of_the_coordinates_follows_the_same_path() -> None:
    weights = MODEL.complete(RNG.random((4, len(MODEL.free))))
    height = MODEL.mapped(lambda values: values[..., 1::3].mean(axis=-1, keepdims=True))
    expected = MODEL.displacements(weights)[:, 1::3].mean(axis=1)
    np.testing.assert_allclose(height.displacements(weights)[:, 0], expected)
