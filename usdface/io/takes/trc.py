"""TRC marker files (Motion Analysis, OpenSim, Vicon, OptiTrack), tab or comma separated.

Three header lines (kind, keys, values), a line of labels, a line of axes, then one row a
frame: number, time, x y z of each marker.
"""

from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.announced import compare_frames
from usdface.io.takes.first_frame import frames_before
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.text_table import (
    Row,
    positive,
    read_numbers,
    read_rows,
    read_text,
    refuse_cut_end,
)
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_trc"]


def read_trc(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a TRC file; an empty cell = occluded.

    The format names no up axis. Times count from the first row; FRAMES_RENUMBERED has its number
    in the recording where it is not 1. All frames and markers are read that are there, and what the
    header counts differently is a finding; a marker without a label is named by its number.

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
    labels, findings = _labels(path, rows, positive(header.get("nummarkers", "")))
    check_size(path, len(rows) - 4, len(labels))
    width = 2 + 3 * len(labels)
    frames, frame_findings = _frames(path, text, rows[4:], header, width)
    table = read_numbers(path, frames, range(1, width))
    timed = bool(np.isfinite(table[:, 0]).any())
    before, renumbered = frames_before(path, positive(frames[0][1][0]) if frames else 0.0, 1)
    raw = RawTake(
        path=path,
        labels=labels,
        positions=table[:, 1:].reshape(len(frames), len(labels), 3),
        seconds=table[:, 0] if timed else None,
        frames=None if timed else read_numbers(path, frames, [0])[:, 0],
        rate=positive(header.get("datarate", "")),
        unit_name=header.get("units", ""),
        first_frame=before,
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + renumbered + frame_findings + take_findings


def _labels(path: Path, rows: list[Row], announced: float) -> tuple[tuple[str, ...], list[Finding]]:
    """Return the label of each marker, "" where it has a column and none; compare with the header.

    Raises
    ------
    InputError
        If labels do not stand above their columns, and are not as many as are announced.
    """
    line, cells = rows[3]
    above = [cells[k] for k in range(2, len(cells), 3)]
    labels = [cell for cell in cells[2:] if cell]
    found: list[Finding] = []
    if [label for label in above if label] == labels:
        labels = above[: max((k + 1 for k, label in enumerate(above) if label), default=0)]
        nameless, found = _nameless(path, rows[4:], 2 + 3 * len(labels))
        labels += [""] * nameless
    elif announced and announced != len(labels):
        raise InputError(
            f"{path}: the header announces {announced:g} markers, "
            f"line {line} names {len(labels)}; correct NumMarkers, or export it again",
            "COLUMNS_WRONG",
        )
    if announced and announced != len(labels):
        message = "the header announces {expected_count:g} markers, the file holds {marker_count}"
        where = str(path)
        found.append(finding("MARKERS_MISCOUNTED", where, message, announced, len(labels)))
    return tuple(labels), found


def _nameless(path: Path, rows: list[Row], start: int) -> tuple[int, list[Finding]]:
    """Return how many markers have columns from `start` on, behind those that have a label."""
    frames = rows if _is_frame(rows[0]) else rows[1:]
    extra = [cells[start:] for _, cells in frames if any(cells[start:])]
    if not extra:
        return 0, []
    last = max(k for cells in extra for k, cell in enumerate(cells) if cell) + 1
    count = last // 3 if all(_is_number(cell) for cells in extra for cell in cells) else 0
    columns = [f"column {start + k + 1}" for k in range(3 * count, last)]
    message = "cells that belong to no marker: {channels}"
    return count, [finding("CHANNEL_IGNORED", str(path), message, columns)] if columns else []


def _is_number(cell: str) -> bool:
    try:
        float(cell or 0)
    except ValueError:
        return False
    return True


def _frames(
    path: Path, text: str, rows: list[Row], header: dict[str, str], width: int
) -> tuple[list[Row], list[Finding]]:
    """Return the rows of frames, without the line of axes; compare with the header."""
    if not _is_frame(rows[0]):
        rows = rows[1:]
    announced = positive(header.get("numframes", ""))
    if rows:
        refuse_cut_end(path, text, rows[-1], width, announced > len(rows))
    return rows, compare_frames(path, announced, len(rows))


def _is_frame(row: Row) -> bool:
    number = row[1][0].strip()
    return number == "0" or bool(positive(number))
