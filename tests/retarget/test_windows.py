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


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0, 100.0, 120.0])
@pytest.mark.parametrize("start", [0.0, 1.0, 3600.0])
def test_rounding_of_times_shifts_no_window(rate: float, start: float) -> None:
    """1.2 s are three windows of 0.4 s, though 1.2 / 0.4 is less than 3."""
    starts = window_starts(start + np.arange(2000) / rate, 0.4)
    np.testing.assert_array_equal(starts, np.ceil(np.arange(len(starts)) * 0.4 * rate - 1e-3))
