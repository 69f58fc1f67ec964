import numpy as np
import pytest

from usdface.numerics.cosines import cosines


def test_cosines_do_not_depend_on_lengths_and_are_0_of_nothing() -> None:
    vectors = np.array([[2.0, 0.0], [3.0, 3.0], [0.0, -1.0], [0.0, 0.0]])
    assert cosines(vectors, np.array([0.0, 5.0])) == pytest.approx([0.0, 0.5**0.5, -1.0, 0.0])
    assert not cosines(vectors, np.zeros(2)).any()
