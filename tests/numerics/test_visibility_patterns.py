import numpy as np
import pytest

from usdface.numerics.visibility_patterns import visibility_patterns


@pytest.mark.parametrize("shape", [(50, 3), (200, 8), (200, 126), (40, 9), (0, 7), (5, 0)])
def test_they_are_the_distinct_rows_in_order(shape: tuple[int, int]) -> None:
    seen = np.random.default_rng(3).random(shape) > 0.05
    patterns, which = visibility_patterns(seen)
    expected, inverse = np.unique(seen, axis=0, return_inverse=True)
    np.testing.assert_array_equal(patterns, expected)
    np.testing.assert_array_equal(which, inverse.ravel())
    np.testing.assert_array_equal(patterns[which], seen)
