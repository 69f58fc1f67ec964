import numpy as np
import pytest

from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION, THIRD_DIFFERENCE


def test_the_deviation_of_normal_values_is_found_by_their_median() -> None:
    values = np.random.default_rng(1).normal(scale=3.0, size=200_000)
    values[:2000] = 1e6  # spikes
    assert MEDIAN_TO_DEVIATION * np.median(np.abs(values)) == pytest.approx(3.0, rel=0.03)


def test_the_variance_of_third_differences_is_that_of_the_noise_times_a_factor() -> None:
    noise = np.random.default_rng(2).normal(size=200_000)
    assert np.diff(noise, 3).var() / noise.var() == pytest.approx(THIRD_DIFFERENCE, rel=0.02)
    assert sum(c**2 for c in (1, -3, 3, -1)) == THIRD_DIFFERENCE
