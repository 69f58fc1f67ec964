import numpy as np
import pytest

from usdface.blend_shapes.blend_shape import BlendShape, Inbetween
from usdface.errors import InputError

RNG = np.random.default_rng(11)
DENSE = np.where(RNG.random((3, 9, 1)) < 0.5, RNG.normal(size=(3, 9, 3)), 0.0)


def test_a_sparse_shape_holds_what_the_dense_one_moves() -> None:
    for dense in DENSE:
        sparse = BlendShape.from_dense("a", dense)
        np.testing.assert_array_equal(sparse.indices, np.flatnonzero(dense.any(axis=1)))
        back = np.zeros_like(dense)
        back[sparse.indices] = sparse.offsets
        np.testing.assert_array_equal(back, dense)
    assert len(BlendShape.from_dense("a", 1e-6 * DENSE[0], tolerance=1e-3).indices) == 0


@pytest.mark.parametrize("indices", [[2, 1], [1, 1]])
def test_indices_are_sorted_and_unique(indices: list[int]) -> None:
    with pytest.raises(InputError, match="sorted and unique"):
        BlendShape("a", np.array(indices), np.ones((2, 3)))


def test_offsets_fit_their_indices() -> None:
    with pytest.raises(InputError, match="offsets of shape"):
        BlendShape("a", np.arange(2), np.zeros((3, 3)))


def test_nothing_in_a_shape_can_be_changed() -> None:
    between = Inbetween("half", 0.5, np.ones((2, 3)), np.ones((2, 3)))
    bent = BlendShape("a", np.array([1, 4]), np.ones((2, 3)), np.ones((2, 3)), (between,))
    for array in (bent.indices, bent.offsets, bent.normal_offsets, between.normal_offsets):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_scaled_shape_moves_in_proportion() -> None:
    between = Inbetween("half", 0.5, np.full((2, 3), 0.1))
    bent = BlendShape("a", np.array([1, 4]), np.ones((2, 3)), np.ones((2, 3)), (between,))
    large = bent.scaled(3.0)
    np.testing.assert_array_equal(large.offsets, 3.0 * bent.offsets)
    np.testing.assert_array_equal(large.inbetweens[0].offsets, 3.0 * between.offsets)
    np.testing.assert_array_equal(large.normal_offsets, bent.normal_offsets)
