"""TRC marker files (Motion Analysis, OpenSim, Vicon, OptiTrack), tab or comma separated.

Three header lines (kind, keys, values), a line of labels, a line of axes, then one row a
frame: number, time, x y z of each marker.
"""

from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import METERS_PER_UNIT
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.text_table import Row, positive, read_numbers, read_rows, read_text
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_trc"]


def read_trc(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a TRC file; an empty cell = occluded.

    The format names no up axis. A row that breaks off counts as a missing frame.

    Raises
    ------
    InputError
        If the file is missing, not a TRC file, or holds no usable frame.
    """
    text = read_text(path)
    if not text.lstrip().lower().startswith("pathfiletype"):
        raise InputError(
            f"{path} is not a TRC file: expected 'PathFileType' in its first line",
            "FILE_UNREADABLE",
        )
    first_line = text.lstrip().splitlines()[0]
    rows = read_rows(path, text, "\t" if "\t" in first_line else ",")
    if len(rows) < 5:
        raise InputError(
            f"{path}: the header is cut off; expected five lines before the data", "FILE_CUT_OFF"
        )
    header = dict(zip((key.lower() for key in rows[1][1]), rows[2][1], strict=False))
    labels = tuple(cell for cell in rows[3][1][2:] if cell)
    announced = positive(header.get("nummarkers", ""))
    if announced and announced != len(labels):
        raise InputError(
            f"{path}: the header announces {announced:g} markers, "
            f"line {rows[3][0]} names {len(labels)}",
            "COLUMNS_WRONG",
        )
    frames, findings = _whole_frames(path, rows[4:], header, 2 + 3 * len(labels))
    check_size(path, len(frames), len(labels))
    table = read_numbers(path, frames, range(1, 2 + 3 * len(labels)))
    seconds = table[:, 0]
    raw = RawTake(
        path=path,
        labels=labels,
        positions=table[:, 1:].reshape(len(frames), len(labels), 3),
        seconds=None if np.isnan(seconds).all() else seconds,
        rate=positive(header.get("datarate", "")),
        unit=METERS_PER_UNIT.get(header.get("units", "").lower()),
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + take_findings


def _whole_frames(
    path: Path, rows: list[Row], header: dict[str, str], width: int
) -> tuple[list[Row], list[Finding]]:
    """Leave out the line of axes and a last row that breaks off; compare with the header."""
    if rows and not positive(rows[0][1][0]):
        rows = rows[1:]
    announced = positive(header.get("numframes", ""))
    if rows and len(rows[-1][1]) < width and len(rows) <= announced:
        rows = rows[:-1]
    if announced <= len(rows):
        return rows, []
    message = "the header announces {expected_count:g} frames, the file holds {frame_count}"
    return rows, [finding("FRAMES_MISSING", str(path), message, announced, len(rows))]
