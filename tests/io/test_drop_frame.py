"""Drop-frame timecode of NTSC video."""

import numpy as np
import pytest

from usdface.io.drop_frame import dropped_labels


@pytest.mark.parametrize("nominal", [30, 60])
def test_a_day_of_labels_is_a_day_of_frames(nominal: int) -> None:
    """SMPTE ST 12-1: ten minutes hold 17,982 frames; a day is right to 0.1 s."""
    assert 600 * nominal - dropped_labels(10, nominal) == 17_982 * nominal // 30
    frames = 86_400 * nominal - dropped_labels(1440, nominal)
    assert abs(frames * 1001 / (1000 * nominal) - 86_400) < 0.1


def test_whole_takes_are_counted_at_once() -> None:
    minutes = np.arange(0.0, 60.0)
    counted = [dropped_labels(int(minute), 30) for minute in minutes]
    np.testing.assert_array_equal(dropped_labels(minutes, 30), counted)
    assert np.count_nonzero(np.diff(counted) == 0) == 5  # into every tenth minute
