import numpy as np
import pytest

from usdface.errors import InputError
from usdface.retarget.solver.bounds import UNIT, Bounds


def test_left_out_bounds_are_0_and_1() -> None:
    low, high = UNIT.over(3, 2)
    assert low.shape == high.shape == (3, 2) and not low.any() and high.all()
    assert UNIT.limits_over(3).shape == (3, 0)


def test_some_frames_of_the_bounds_are_the_bounds_of_some_frames() -> None:
    rng = np.random.default_rng(0)
    lower, limits = rng.uniform(0, 0.4, (6, 3)), rng.uniform(0, 1, (6, 1))
    bounds = Bounds(lower, np.array([1.0, 0.8, 0.5]), np.array([[1.0, -1.0, 0.0]]), limits)
    for some in (slice(2, 5), np.array([5, 0])):
        part = bounds.at(some)
        count = len(lower[some])
        np.testing.assert_array_equal(part.over(count, 3)[0], lower[some])
        np.testing.assert_array_equal(part.over(count, 3)[1], bounds.over(6, 3)[1][some])
        np.testing.assert_array_equal(part.limits_over(count), limits[some])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"lower": np.array([0.0, np.nan])}, "finite"),
        ({"lower": np.array([0.5]), "upper": np.array([0.4])}, "above its upper"),
        ({"rows": np.zeros(3)}, "shape"),
    ],
)
def test_bounds_that_leave_no_weight_are_refused(fields: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Bounds(**fields)
