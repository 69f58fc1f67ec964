import numpy as np
import pytest

from usdface.geometry.nearest_points import nearest_points


@pytest.mark.parametrize("count", [1, 4])
def test_the_nearest_others_are_those_of_all_distances(count: int) -> None:
    points = np.random.default_rng(3).normal(size=(50, 3))
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(apart, np.inf)
    np.testing.assert_array_equal(
        nearest_points(points, count), np.argsort(apart, axis=1)[:, :count]
    )


def test_points_at_one_place_are_near_each_other() -> None:
    points = np.zeros((5, 3))
    near = nearest_points(points, 2)
    assert near.shape == (5, 2) and (near != np.arange(5)[:, None]).all()


def test_there_may_be_too_few() -> None:
    assert nearest_points(np.zeros((1, 3)), 4).shape == (1, 0)
    np.testing.assert_array_equal(nearest_points(np.eye(2), 4), [[1], [0]])
