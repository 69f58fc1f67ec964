"""The reach of blend shapes: a bound that no weights beat, met where shapes move one way."""

import numpy as np
import pytest

from usdface.retarget.shape_reach import beyond_reach


def test_no_weights_leave_less() -> None:
    rng = np.random.default_rng(1)
    offsets = rng.normal(size=(5, 4, 3))
    displaced = 6.0 * rng.normal(size=(200, 4, 3))
    least = beyond_reach(displaced, offsets)
    assert 0.3 < (least > 0.0).mean() < 1.0  # some within reach, some beyond
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 5), axis=-1).reshape(-1, 5)
    weights = np.vstack([corners, rng.random((3000, 5))])
    reached = np.einsum("ws,smk->wmk", weights, offsets)
    for marker in range(4):
        left = np.linalg.norm(displaced[:, None, marker] - reached[None, :, marker], axis=2)
        assert (left.min(axis=1) >= least[:, marker] - 1e-12).all()


def test_shapes_of_one_line_reach_as_far_as_their_sum() -> None:
    offsets = np.array([[[0.0, 1.0, 0.0]], [[0.0, 2.0, 0.0]], [[0.0, -1.0, 0.0]]])
    displaced = np.array([[[0.0, 5.0, 0.0]], [[0.0, 2.0, 0.0]], [[0.0, -4.0, 0.0]]])
    assert beyond_reach(displaced, offsets)[:, 0] == pytest.approx([2.0, 0.0, 3.0])


def test_motion_across_the_shapes_is_beyond_them() -> None:
    offsets = np.array([[[0.0, 1.0, 0.0]]])
    assert beyond_reach(np.array([[[3.0, 0.0, 0.0]]]), offsets) == pytest.approx(3.0)


def test_a_marker_at_rest_is_reached() -> None:
    assert beyond_reach(np.zeros((2, 3, 3)), np.ones((1, 3, 3))) == pytest.approx(np.zeros((2, 3)))


def test_without_shapes_all_motion_is_beyond() -> None:
    displaced = np.ones((1, 2, 3))
    assert beyond_reach(displaced, np.zeros((0, 2, 3))) == pytest.approx(np.sqrt(3.0))
