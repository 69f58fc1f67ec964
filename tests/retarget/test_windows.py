import numpy as np
import pytest

from usdface.retarget.windows import window_starts


def test_windows_are_as_long_as_asked() -> None:
    times = 3.0 + np.arange(60) / 60.0
    assert window_starts(times, 0.25).tolist() == [0, 15, 30, 45]


@pytest.mark.parametrize(("frames", "starts"), [(66, [0, 24, 48]), (50, [0, 24]), (58, [0, 24])])
def test_a_short_rest_belongs_to_the_window_before(frames: int, starts: list[int]) -> None:
    assert window_starts(np.arange(frames) / 60.0, 0.4).tolist() == starts


def test_no_length_is_single_frames_and_no_window_is_empty() -> None:
    times = np.array([0.0, 0.1, 5.0, 5.1, 9.9])
    assert window_starts(times, 0.0).tolist() == [0, 1, 2, 3, 4]
    assert window_starts(times, 1.0).tolist() == [0, 2]
    assert window_starts(times[:1], 1.0).tolist() == [0]
