import numpy as np
import pytest

from usdface.takes import frame_step


def test_the_frame_step_is_that_of_most_frames() -> None:
    assert frame_step(np.array([0.0, 0.1, 0.2, 0.9, 1.0])) == pytest.approx(0.1)
    assert frame_step(np.array([5.0])) == 0.0
