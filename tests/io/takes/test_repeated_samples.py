import numpy as np

from usdface.io.takes.repeated_samples import first_repeat


def test_the_later_of_two_samples_in_a_cell_is_named() -> None:
    assert first_repeat(np.array([4, 1, 3, 1, 4])) == 3
    assert first_repeat(np.array([4, 1, 3])) is None
    assert first_repeat(np.zeros(0, np.int64)) is None
