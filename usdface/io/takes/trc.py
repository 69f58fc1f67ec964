"""TRC marker files (Motion Analysis, OpenSim, Vicon, OptiTrack), tab or comma separated.

Three header lines (kind, keys, values), a line of labels, a line of axes, then one row a
frame: number, time, x y z of each marker.
"""

from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.text_table import (
    Row,
    nameless_columns,
    positive,
    read_numbers,
    read_rows,
    read_text,
    refuse_cut_end,
)
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_trc"]

_MOST_FRAMES = 1 << 31  # a larger number is no frame's


def read_trc(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a TRC file; an empty cell = occluded.

    The format names no up axis. Times count from the first row; FRAMES_RENUMBERED has its number
    in the recording where it is not 1. A file that ends after a row gives its rows, and
    FRAMES_MISSING.

    Raises
    ------
    InputError
        If the file is missing, not a TRC file, cut off within a row, or holds no usable frame.
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
            f"line {rows[3][0]} names {len(labels)}; correct NumMarkers, or export it again",
            "COLUMNS_WRONG",
        )
    check_size(path, len(rows) - 4, len(labels))
    width = 2 + 3 * len(labels)
    frames, findings = _frames(path, text, rows[4:], header, width)
    table = read_numbers(path, frames, range(1, width))
    if count := nameless_columns(["named"] * width, frames):
        message = "not read: {channels}"
        columns = [f"{count} columns without a label"]
        findings.append(finding("CHANNEL_IGNORED", str(path), message, columns))
    seconds = table[:, 0]
    first = positive(frames[0][1][0]) if frames else 0.0
    if 1 < first < _MOST_FRAMES:
        message = "time 0 is frame {frame_number:g} of the recording"
        findings.append(finding("FRAMES_RENUMBERED", str(path), message, first))
    raw = RawTake(
        path=path,
        labels=labels,
        positions=table[:, 1:].reshape(len(frames), len(labels), 3),
        seconds=None if np.isnan(seconds).all() else seconds,
        rate=positive(header.get("datarate", "")),
        unit_name=header.get("units", ""),
        first_frame=int(first) - 1 if 1 < first < _MOST_FRAMES else 0,
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + take_findings


def _frames(
    path: Path, text: str, rows: list[Row], header: dict[str, str], width: int
) -> tuple[list[Row], list[Finding]]:
    """Return the rows of frames, without the line of axes; compare with the header."""
    first = rows[0][1][0].strip()
    if first != "0" and not positive(first):
        rows = rows[1:]
    announced = positive(header.get("numframes", ""))
    if rows:
        refuse_cut_end(path, text, rows[-1], width, announced > len(rows))
    if announced <= len(rows):
        return rows, []
    message = "the header announces {expected_count:g} frames, the file holds {frame_count}"
    return rows, [finding("FRAMES_MISSING", str(path), message, announced, len(rows))]
