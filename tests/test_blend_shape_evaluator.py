from dataclasses import replace

import numpy as np
import pytest
from curved_world import COMBINED, make_curved_world
from pxr import Usd, UsdSkel

from usdface.blend_shape_evaluator import (
    BlendShapeEvaluator,
    evaluator_of,
    with_combinations,
)
from usdface.face.known_limits import with_known_limits
from usdface.inbetween_path import InbetweenPath
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import BlendShape, Combination, Mesh

RNG = np.random.default_rng(2)
MESH = make_curved_world().rig.meshes[0]
POINTS = np.arange(0, len(MESH.points), 7)
MODEL, _ = evaluator_of(MESH, POINTS)


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


def small(**combinations: Combination) -> tuple[BlendShapeEvaluator, list[str]]:
    index, offsets = np.array([0]), np.array([[0.0, 0.01, 0.0]])
    shapes = tuple(
        BlendShape(n, index, offsets, combination=combinations.get(n)) for n in ("a", "b", "c", "d")
    )
    mesh = Mesh("m", np.zeros((3, 3)), np.array([3]), np.arange(3), shapes=shapes)
    model, findings = evaluator_of(mesh, index)
    return model, [f"{f.code} {f.where}" for f in findings]


def test_a_combination_of_a_combination() -> None:
    model, found = small(c=Combination(("a", "d")), d=Combination(("a", "b"), "min"))
    assert found == [] and model.free.tolist() == [0, 1]
    np.testing.assert_allclose(model.complete(np.array([[0.5, 0.4]])), [[0.5, 0.4, 0.2, 0.4]])
    force = np.array([[0.0, 1.0, 0.0]])
    # c = a min(a, b): its slopes are 0.4 for a and 0.5 for b, where b is the least.
    gradient = model.gradient(model.complete(np.array([[0.5, 0.4]])), force)
    np.testing.assert_allclose(gradient, [[0.01 * 1.4, 0.01 * 2.5]])


@pytest.mark.parametrize(
    "combinations",
    [
        {"c": Combination(("a", "nobody"))},
        {"c": Combination(("a", "c"))},
        {"c": Combination(())},
    ],
)
def test_what_makes_no_sense_is_said_and_solved_as_its_own(combinations) -> None:
    model, found = small(**combinations)
    assert found == ["COMBINATION_IGNORED c"] and model.linear and len(model.free) == 4


def test_a_ring_is_said() -> None:
    model, found = small(c=Combination(("a", "d")), d=Combination(("c", "b")))
    assert found == ["COMBINATION_IGNORED c", "COMBINATION_IGNORED d"] and model.linear


def test_weights_move_what_their_inbetweens_and_combinations_move() -> None:
    model, _ = small(c=Combination(("a", "d")), d=Combination(("a", "b"), "min"))
    still = np.zeros_like(model.offsets)
    still[2] = model.offsets[2]  # c alone, which a and, through d, b drive
    assert replace(model, offsets=still).moving.tolist() == [True, True, False, False]
    path = InbetweenPath(1, np.array([0.0, 0.5, 1.0]), np.array([[0.0], [0.01], [0.0]]))
    back = BlendShapeEvaluator(np.zeros((2, 1)), (path,))
    assert back.moving.tolist() == [False, True]


def test_limits_are_rows_of_the_free_weights() -> None:
    model, found = small(d=Combination(("a", "b"), "limit"), b=Combination(("a", "c")))
    assert found == [] and model.free.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(
        model.limit_rows, [[-1.0, 0.0, 1.0]]
    )  # d <= a; b has no own weight


def test_a_known_limit_is_found_in_any_spelling() -> None:
    model = BlendShapeEvaluator(np.ones((3, 6)))
    found = with_known_limits(model, ("JawOpen", "smile", "mouth_close"))
    assert found.limits.tolist() == [[2, 0]]
    assert with_known_limits(found, ("JawOpen", "smile", "mouth_close")).limits.tolist() == [[2, 0]]
    assert not len(with_known_limits(model, ("jawOpen", "a", "b")).limits)


def test_other_columns_keep_their_weights() -> None:
    names = ("other", *MESH.shape_names)
    weights = RNG.random((3, len(names)))
    found = with_combinations(MESH, names, weights)
    np.testing.assert_array_equal(found[:, 0], weights[:, 0])
    np.testing.assert_allclose(found[:, 1:], MODEL.complete(weights[:, 1:][:, MODEL.free]))


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


def test_a_product_of_three_has_exact_secants() -> None:
    model, _ = small(d=Combination(("a", "b", "c")))
    start, end = np.array([[0.1, 0.2, 0.9]]), np.array([[0.8, 0.7, 0.3]])
    start, end = model.complete(start), model.complete(end)
    change = np.einsum("fp,fpn->fn", (end - start)[:, :3], model.secants(start, end))
    moved = model.displacements(end) - model.displacements(start)
    np.testing.assert_allclose(change, moved, atol=1e-15)


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
    model, _ = small(c=Combination(("a", "b")), d=Combination(("c", "a")))
    moved = model.reordered(np.array([0, 2, 3]))  # without b, whose weight is 0
    assert moved.linear and moved.offsets[:, 1].tolist() == [0.01, 0.0, 0.0]


def test_a_linear_function_of_the_coordinates_follows_the_same_path() -> None:
    weights = MODEL.complete(RNG.random((4, len(MODEL.free))))
    height = MODEL.mapped(lambda values: values[..., 1::3].mean(axis=-1, keepdims=True))
    expected = MODEL.displacements(weights)[:, 1::3].mean(axis=1)
    np.testing.assert_allclose(height.displacements(weights)[:, 0], expected)
