"""Frames that repeat the one before them."""

from pathlib import Path

import numpy as np
import pytest

from usdface.io.takes.repeated_frames import report_repeated_frames

MOVING = np.random.default_rng(4).normal(size=(120, 5, 3))
FILE = Path("take.trc")


@pytest.mark.parametrize(
    ("recorded", "written", "repeated"), [(30, 60, 60), (25, 30, 20), (30, 240, 105), (60, 60, 0)]
)
def test_a_recording_at_a_lower_rate_than_its_file_is_announced(
    recorded: int, written: int, repeated: int
) -> None:
    positions = MOVING[np.arange(120) * recorded // written].copy()
    positions[:, 4] = np.nan  # a hidden marker repeats nothing
    findings = report_repeated_frames(FILE, positions)
    counts = [f.values["repeated_count"] for f in findings if f.code == "FRAMES_REPEATED"]
    assert counts == [repeated] * bool(repeated)


def test_a_rest_a_few_lost_frames_and_a_pose_are_none() -> None:
    rest = MOVING.copy()
    rest[:60] = rest[0]
    lost = MOVING.copy()
    lost[20:30:5] = lost[19:29:5]
    hidden = MOVING.copy()
    hidden[::4] = np.nan
    for positions in (rest, lost, hidden, np.repeat(MOVING[:2], 3, axis=0)):
        assert report_repeated_frames(FILE, positions) == []
