import numpy as np
import pytest

from usdface.geometry.units_and_axes import METERS_PER_UNIT, in_metres, to_metres


def test_up_becomes_y_and_the_system_stays_right_handed() -> None:
    turn = to_metres(1.0, "Z")
    np.testing.assert_array_equal(np.array([0, 0, 1.0]) @ turn, [0, 1, 0])
    np.testing.assert_array_equal(np.array([0, 1.0, 0]) @ turn, [0, 0, -1])
    assert np.linalg.det(turn) == 1
    np.testing.assert_array_equal(to_metres(1.0, "Y"), np.eye(3))


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("unit", METERS_PER_UNIT)
def test_positions_and_matrix_agree(up_axis: str, unit: str) -> None:
    positions = np.random.default_rng(0).normal(size=(4, 5, 3))
    meters = METERS_PER_UNIT[unit]
    np.testing.assert_array_equal(
        in_metres(positions, meters, up_axis), positions @ to_metres(meters, up_axis)
    )


def test_a_hidden_component_stays_its_own() -> None:
    moved = in_metres(np.array([[np.nan, 1.0, 2.0]]), 1.0, "Z")
    np.testing.assert_array_equal(moved, [[np.nan, 2, -1]])


def test_a_long_name_means_the_short_one() -> None:
    for short, long in (("mm", "millimeters"), ("cm", "centimeters"), ("m", "meters")):
        assert METERS_PER_UNIT[short] == METERS_PER_UNIT[long]
    assert METERS_PER_UNIT["inches"] == METERS_PER_UNIT["in"] == 25.4 * METERS_PER_UNIT["mm"]
