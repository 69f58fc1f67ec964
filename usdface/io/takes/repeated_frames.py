"""Frames that repeat the one before them, as of a recording at a lower rate than its file's.

Between such frames markers stand still, and then jump: a blink looks like a spike, and noise is
underestimated. From 25 to 30 Hz a sixth of the frames are repeated, from 30 to 60 half of them.
"""

from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.numerics.frame_ranges import frame_ranges

__all__ = ["report_repeated_frames"]

# Repeats in a row at most, as from 30 to 240 Hz: a face drawn by hand rests longer.
_LONGEST = 7
_SHARE = 0.1  # of the frames: fewer may be lost frames of a recorder
_FEWEST = 24  # frames: a shorter take is a pose or two


def report_repeated_frames(path: Path, positions: FloatArray) -> list[Finding]:
    """Return FRAMES_REPEATED where many frames have exactly the positions of the one before.

    Parameters
    ----------
    path : Path
        The file that the message names.
    positions : (F, M, 3) float64
        NaN = occluded.
    """
    hidden = np.isnan(positions)
    same = (positions[1:] == positions[:-1]) | (hidden[1:] & hidden[:-1])
    repeated = same.all(axis=(1, 2)) & ~hidden[1:].all(axis=(1, 2))
    runs = [last - first + 1 for first, last in frame_ranges(repeated)]
    count = sum(run for run in runs if run <= _LONGEST)
    if len(positions) < _FEWEST or count < _SHARE * len(positions):
        return []
    message = (
        "{repeated_count} of {frame_count} frames repeat the one before them: the recording has a "
        "lower rate than the file"
    )
    return [finding("FRAMES_REPEATED", str(path), message, count, len(positions))]
