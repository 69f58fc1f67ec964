import numpy as np
import pytest

from usdface.numerics.rms import rms

VALUES = np.array([[3.0, 4.0, np.nan], [np.nan, np.nan, np.nan], [0.0, -1.0, 2.0]])


def test_missing_values_are_left_out() -> None:
    assert rms(VALUES) == pytest.approx(np.sqrt(np.nanmean(VALUES**2)))
    np.testing.assert_allclose(rms(VALUES, axis=1), np.sqrt([12.5, 0.0, 5.0 / 3.0]))


@pytest.mark.parametrize("values", [np.zeros(0), np.full(3, np.nan)])
def test_of_no_values_it_is_what_the_caller_says(values: np.ndarray) -> None:
    assert rms(values) == 0.0
    assert np.isnan(rms(values, empty=np.nan))


def test_it_scales_with_the_values_and_ignores_their_signs_and_order() -> None:
    values = np.random.default_rng(1).normal(size=(4, 50))
    for other in (-values, values[::-1], values[:, ::-1]):
        assert rms(other) == pytest.approx(rms(values), rel=1e-14)
    np.testing.assert_allclose(rms(2.5 * values, axis=0), 2.5 * rms(values, axis=0), rtol=1e-14)
