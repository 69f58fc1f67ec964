import numpy as np
import pytest
from scipy.signal import find_peaks

from usdface.numerics.local_maxima import highest, local_maxima


@pytest.mark.parametrize("seed", range(20))
def test_maxima_are_those_of_scipy(seed: int) -> None:
    """Also where tops are flat."""
    rng = np.random.default_rng(seed)
    curve, least = rng.normal(size=rng.integers(0, 300)).cumsum(), float(rng.normal())
    for signal, apart in ((curve, int(rng.integers(1, 12))), (np.round(curve), 1)):
        expected, _ = find_peaks(signal, height=least, distance=apart)
        assert local_maxima(signal, least, apart).tolist() == expected.tolist()


def test_the_ends_are_no_maxima_unless_something_lower_is_put_around() -> None:
    curve = np.array([2.0, 1.0, 3.0])
    assert local_maxima(curve, 0.0).tolist() == []
    assert local_maxima(np.pad(curve, 1, constant_values=-np.inf), 0.0).tolist() == [1, 3]


@pytest.mark.parametrize(
    ("curve", "middle"),
    [([0, 3, 3, 3, 1, 3], 2), ([3, 3, 3, 0], 1), ([1, 2], 1), ([2, 2, 2], 1), ([5.0], 0)],
)
def test_the_middle_of_the_first_flat_top_is_the_highest(curve: list[float], middle: int) -> None:
    assert highest(np.array(curve, float)) == middle
