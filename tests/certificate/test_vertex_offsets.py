import numpy as np
import pytest
from dense_offsets import dense_offsets

RNG = np.random.default_rng(12)


def scattered(shapes: int, vertices: int) -> np.ndarray:
    values = RNG.normal(size=(shapes, vertices, 3)).astype(np.float32)
    values[RNG.random((shapes, vertices)) < 0.7] = 0
    return values


@pytest.mark.parametrize(("shapes", "vertices"), [(6, 50), (0, 4), (3, 0)])
def test_sparse_offsets_are_what_was_given(shapes: int, vertices: int) -> None:
    values = scattered(shapes, vertices)
    offsets = dense_offsets(values)
    assert (offsets.shapes, offsets.count) == (shapes, vertices)
    weights = RNG.normal(size=(4, shapes))
    np.testing.assert_allclose(offsets.summed(weights), np.tensordot(weights, values, 1), atol=1e-6)
    np.testing.assert_array_equal(offsets.at(np.arange(shapes), np.arange(vertices)), values)


def test_some_vertices_by_some_shapes() -> None:
    values = scattered(6, 50)
    shapes, vertices = np.array([4, 1]), np.array([7, 7, 49, 0])
    found = dense_offsets(values).at(shapes, vertices)
    np.testing.assert_array_equal(found, values[np.ix_(shapes, vertices)])


def test_each_shape_by_a_matrix() -> None:
    values, matrices = scattered(6, 50), RNG.normal(size=(6, 3, 3))
    expected = np.einsum("bij,bnj->ni", matrices, values)
    np.testing.assert_allclose(dense_offsets(values).transformed(matrices), expected, atol=1e-5)


def test_vertices_that_the_same_shapes_move_have_the_same_number() -> None:
    values = scattered(6, 500)
    numbers = dense_offsets(values).signatures()
    patterns = np.unique(values.any(axis=2).T, axis=0, return_inverse=True)[1].ravel()
    assert len(np.unique(np.stack([numbers, patterns]), axis=1).T) == len(np.unique(numbers))
    assert len(np.unique(numbers)) == len(np.unique(patterns))
