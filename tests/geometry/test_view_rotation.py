import numpy as np
import pytest

from usdface.geometry.view_rotation import view_rotation


@pytest.mark.parametrize(
    ("yaw", "pitch", "stands"),
    [(0, 0, (0, 0, 1)), (90, 0, (1, 0, 0)), (-90, 0, (-1, 0, 0)), (0, 90, (0, 1, 0))],
)
def test_the_place_of_the_camera_is_ahead_in_its_space(
    yaw: float, pitch: float, stands: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose(view_rotation(yaw, pitch) @ stands, (0, 0, 1), atol=1e-15)


def test_a_camera_that_is_turned_stays_upright() -> None:
    turn = view_rotation(35.0, -20.0)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(turn) > 0 and turn[0, 1] == 0 and turn[1, 1] > 0
