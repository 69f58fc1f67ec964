"""Tables with a row for each frame and columns for x, y and perhaps confidence of each point.

DeepLabCut, SLEAP, OpenFace and MediaPipe write such tables; each has a module that finds the
columns.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.takes.raw_take import check_size
from usdface.io.takes.text_table import Row, read_numbers
from usdface.io.takes.track_text import TrackTable

__all__ = ["samples_of_columns"]


def samples_of_columns(
    path: Path,
    rows: Sequence[Row],
    frame_column: int,
    points: Sequence[tuple[str, Sequence[int]]],
    shared: Sequence[int] = (),
) -> TrackTable:
    """Return a sample for each row and point, row after row.

    Parameters
    ----------
    path : Path
    rows : sequence
        Those with data.
    frame_column : int
        -1 = rows are counted from 0.
    points : sequence of (str, sequence of int)
        Label and columns of each point, equally many.
    shared : sequence of int
        Columns that hold for all points of a row.

    Returns
    -------
    TrackTable
        Its numbers are the frame, the columns of the point, the shared ones.

    Raises
    ------
    InputError
        If there is no row, a cell is no number, or the table is out of all proportion to the file.
    """
    if not (rows and points):
        raise InputError(f"{path}: there are no frames of data; expected one", "TAKE_EMPTY")
    check_size(path, len(rows), len(points))
    clock = [frame_column] if frame_column >= 0 else []
    picked = [column for _, columns in points for column in columns]
    table = read_numbers(path, rows, [*clock, *shared, *picked])
    frames = table[:, 0] if clock else np.arange(len(rows), dtype=np.float64)
    begin = len(clock) + len(shared)
    own = table[:, begin:].reshape(len(rows), len(points), -1)
    common = np.concatenate([frames[:, None], table[:, len(clock) : begin]], axis=1)
    every: FloatArray = np.repeat(common[:, None], len(points), axis=1)
    numbers = np.concatenate([every[..., :1], own, every[..., 1:]], axis=2)
    return TrackTable(
        tuple(label for label, _ in points),
        np.tile(np.arange(len(points)), len(rows)),
        numbers.reshape(len(rows) * len(points), numbers.shape[2]),
        [line for line, _ in rows for _ in points],
    )
