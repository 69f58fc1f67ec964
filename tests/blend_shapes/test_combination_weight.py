import numpy as np
from few_shapes import few_shapes

from usdface.blend_shapes.blend_shape import Combination
from usdface.blend_shapes.combination_weight import CombinationWeight, in_order


def test_the_least_of_two_takes_over_on_the_way() -> None:
    least = CombinationWeight(2, np.array([0, 1]), least=True)
    start, end = np.array([[0.2, 0.6, 0.2]]), np.array([[0.8, 0.4, 0.4]])
    assert least.of(start).tolist() == [0.2] and least.of(end).tolist() == [0.4]
    change = (least.secants(start, end) * (end - start)[:, :2]).sum()
    np.testing.assert_allclose(change, 0.2, atol=1e-15)


def test_a_product_of_three_has_exact_secants() -> None:
    model, _ = few_shapes(d=Combination(("a", "b", "c")))
    start, end = np.array([[0.1, 0.2, 0.9]]), np.array([[0.8, 0.7, 0.3]])
    start, end = model.complete(start), model.complete(end)
    change = np.einsum("fp,fpn->fn", (end - start)[:, :3], model.secants(start, end))
    moved = model.displacements(end) - model.displacements(start)
    np.testing.assert_allclose(change, moved, atol=1e-15)


def test_parents_come_before_what_builds_on_them() -> None:
    last, first = (CombinationWeight(s, np.array([s - 1, 0]), False) for s in (3, 2))
    ring = [CombinationWeight(s, np.array([9 - s]), False) for s in (4, 5)]
    ordered, circular = in_order([last, ring[0], first, ring[1]])
    assert ordered == (first, last) and circular == ring
