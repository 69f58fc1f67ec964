import numpy as np

from usdface.numerics.ramps import linear_ramp, smooth_step


def test_a_linear_ramp_is_0_before_1_after_and_linear_between() -> None:
    x = np.array([-1.0, 2.0, 3.0, 3.5, 4.0, 9.0])
    np.testing.assert_array_equal(linear_ramp(x, 2.0, 4.0), [0.0, 0.0, 0.5, 0.75, 1.0, 1.0])
    np.testing.assert_array_equal(linear_ramp(x, 4.0, 2.0), [1.0, 1.0, 0.5, 0.25, 0.0, 0.0])


def test_it_rises_from_0_to_1_and_is_level_at_both_ends() -> None:
    x = np.linspace(-1.0, 2.0, 3001)
    values = smooth_step(x)
    assert values[x <= 0.0].max() == 0.0 and values[x >= 1.0].min() == 1.0
    assert (np.diff(values) >= 0.0).all()
    np.testing.assert_allclose(values + values[::-1], 1.0, atol=1e-12)
    assert np.abs(np.diff(values)).max() < 1.6 * (x[1] - x[0])
    assert np.abs(np.diff(values, 2)).max() < 7.0 * (x[1] - x[0]) ** 2
