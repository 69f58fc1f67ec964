import numpy as np

from usdface.smooth_step import smooth_step


def test_it_rises_from_0_to_1_and_is_level_at_both_ends() -> None:
    x = np.linspace(-1.0, 2.0, 3001)
    values = smooth_step(x)
    assert values[x <= 0.0].max() == 0.0 and values[x >= 1.0].min() == 1.0
    assert (np.diff(values) >= 0.0).all()
    np.testing.assert_allclose(values + values[::-1], 1.0, atol=1e-12)
    assert np.abs(np.diff(values)).max() < 1.6 * (x[1] - x[0])
    assert np.abs(np.diff(values, 2)).max() < 7.0 * (x[1] - x[0]) ** 2
