import numpy as np
import pytest

from usdface.geometry.stray_points import stray_move, stray_point, stray_points, usual_size

CLOUD = np.random.default_rng(0).normal(size=(200, 3))
ALL = np.arange(len(CLOUD))


@pytest.mark.parametrize("far", [30.0, 1e6, 1e30])
def test_a_few_points_far_off_are_found_and_measure_nothing(far: float) -> None:
    points = CLOUD.copy()
    points[[7, 50]] = far * np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    assert np.flatnonzero(stray_points(points)).tolist() == [7, 50]
    assert usual_size(points) == pytest.approx(usual_size(CLOUD), rel=0.1)
    assert stray_point(points)[1:3] == (7, " and 1 more")


def test_a_body_below_a_finely_meshed_face_is_not_far_off() -> None:
    body = np.random.default_rng(1).uniform(size=(400, 3)) * [0.4, 1.6, 0.3] - [0.2, 1.7, 0.1]
    points = np.concatenate([0.1 * np.tile(CLOUD, (50, 1)), body])
    assert not stray_points(points).any() and not stray_point(points)


@pytest.mark.parametrize("count", [0, 1, 3, 19])
def test_of_few_points_none_is_stray(count: int) -> None:
    points = np.zeros((count, 3))
    points[:1] = 1e6
    assert not stray_points(points).any()


def test_points_in_one_place_have_no_size() -> None:
    points = np.zeros((100, 3))
    points[3] = 5.0
    assert usual_size(np.zeros((100, 3))) == 0.0
    assert stray_move(np.ones((1, 3)), np.array([3]), np.zeros((100, 3))) == ()


@pytest.mark.parametrize("rest", [0.0, 0.05])
def test_a_shape_that_drags_a_point_off_is_found(rest: float) -> None:
    offsets = np.full((200, 3), rest)
    offsets[9] = [30.0, 0.0, 0.0]
    assert stray_move(offsets, ALL, CLOUD)[1] == 9
    assert stray_move(offsets[9:10], ALL[9:10], CLOUD)[1] == 9


def test_a_shape_that_moves_all_or_ever_farther_is_meant() -> None:
    """As a whole piece that is moved out of sight, or a spike that grows out of a sphere."""
    assert stray_move(np.full((200, 3), 50.0), ALL, CLOUD) == ()
    growing = np.geomspace(0.1, 50.0, 200)[:, None] * [1.0, 0.0, 0.0]
    assert stray_move(growing, ALL, CLOUD) == ()
