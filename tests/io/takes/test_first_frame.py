from pathlib import Path

import pytest

from usdface.io.takes.first_frame import frames_before

FILE = Path("take.trc")


@pytest.mark.parametrize(
    ("number", "start", "before"),
    [(1.0, 1, 0), (0.0, 0, 0), (0.0, 1, 0), (101.0, 1, 100), (240, 0, 240)],
)
def test_frames_before_the_first_are_counted_and_told(number, start, before):
    count, findings = frames_before(FILE, number, start)
    assert count == before
    assert [dict(f.values) for f in findings] == ([{"frame_number": number}] if before else [])


def test_a_number_that_is_no_frames_is_none():
    assert frames_before(FILE, 1e15, 1) == frames_before(FILE, float("nan"), 1) == (0, [])
