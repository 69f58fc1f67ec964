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
        ours = MESH.points[POINTS] + MODEL.explained(row[None]).reshape(-1, 3)
        np.testing.assert_allclose(ours, np.array(points)[POINTS], atol=1e-7)


def test_combinations_follow_their_parents() -> None:
    free = RNG.random((5, len(MODEL.free)))
    full = dict(zip(MESH.shape_names, MODEL.complete(free).T, strict=True))
    np.testing.assert_allclose(full["smileOpenLeft"], full["jawOpen"] * full["mouthSmileLeft"])
    least = np.minimum(full["browDownLeft"], full["browInnerUp"])
    np.testing.assert_allclose(full["browsWorried"], least)
    assert len(MODEL.free) == len(MESH.shapes) - len(COMBINED)


def test_the_pull_is_the_derivative() -> None:
    free, forces = RNG.random((4, len(MODEL.free))), RNG.normal(size=(4, 3 * len(POINTS)))
    found = MODEL.pulled(MODEL.complete(free), forces)
    step = 1e-6
    for column in range(len(MODEL.free)):
        ahead, behind = free.copy(), free.copy()
        ahead[:, column] += step
        behind[:, column] -= step
        moved = MODEL.explained(MODEL.complete(ahead)) - MODEL.explained(MODEL.complete(behind))
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
    pulled = model.pulled(model.complete(np.array([[0.5, 0.4]])), force)
    np.testing.assert_allclose(pulled, [[0.01 * 1.4, 0.01 * 2.5]])


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
    assert found == ["COMBINATION_IGNORED c"] and model.straight and len(model.free) == 4


def test_a_ring_is_said() -> None:
    model, found = small(c=Combination(("a", "d")), d=Combination(("c", "b")))
    assert found == ["COMBINATION_IGNORED c", "COMBINATION_IGNORED d"] and model.straight


def test_limits_are_rows_of_the_free_weights() -> None:
    model, found = small(d=Combination(("a", "b"), "limit"), b=Combination(("a", "c")))
    assert found == [] and model.free.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(model.rows, [[-1.0, 0.0, 1.0]])  # d <= a; b has no own weight


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
