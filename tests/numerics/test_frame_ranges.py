import numpy as np

from usdface.numerics.frame_ranges import frame_ranges


def test_runs_have_first_and_last_frame() -> None:
    assert frame_ranges(np.array([True, True, False, True, False])) == [(0, 1), (3, 3)]
    assert frame_ranges(np.zeros(3, dtype=bool)) == []
