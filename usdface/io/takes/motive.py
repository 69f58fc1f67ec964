"""Marker CSV as OptiTrack Motive exports it (format versions 1.2 and later).

The first line holds metadata as key, value, key, value ...; below it come rows that describe each
column (type, name, ID, sometimes parent, quantity), then the row
``Frame, Time (Seconds), X, Y, Z ...`` and the data. Y is up, right-handed.
"""

import re
from itertools import pairwise
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.announced import compare_frames
from usdface.io.takes.first_frame import frames_before
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.text_table import (
    Row,
    delimiter_of,
    nameless_columns,
    positive,
    read_numbers,
    read_rows,
    read_text,
    refuse_cut_end,
    refuse_cut_table,
)
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_motive"]

_START = re.compile(r"\d+-\d+-\d+ (\d{1,2})\.(\d{2})\.(\d{2})(?:\.(\d+))?(?: ([AP])M)?")
_SUBFRAMES = re.compile(r"(.*[:;]\d+)\.(\d+)")
_HEADER_ROWS = 12  # exports have 6 or 7: metadata, rows that describe the columns, axes


def read_motive(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a Motive CSV export; an empty cell = occluded.

    Only measured markers (type ``Marker``) are read: rigid bodies, bones and the markers
    that are solved from them are left out. The start timecode is that of the TimeCode
    column, its subframe as a fraction; without one it is the time of day of the first frame, from
    Capture Start Time.

    Raises
    ------
    InputError
        If the file is missing, cut off, not a Motive export, or holds no usable marker frame.
    """
    text = read_text(path)
    rows = read_rows(path, text, delimiter_of(text))
    first = rows[0][1]
    if first[0] != "Format Version":
        raise InputError(
            f"{path} is not a Motive export: expected 'Format Version' in line 1", "FILE_UNREADABLE"
        )
    about = dict(pairwise(first))  # notes may hold commas of their own
    top = next((i for i, row in enumerate(rows[:_HEADER_ROWS]) if row[1][0] == "Frame"), None)
    if top is None:
        raise InputError(
            f"{path}: the row 'Frame, Time (Seconds), X, Y, Z ...' is missing; "
            "export it as CSV again",
            "COLUMNS_WRONG",
        )
    refuse_cut_table(path, rows[top:])
    markers, ignored = _columns(path, rows[1 : top + 1])
    data = rows[top + 1 :]
    announced = positive(about.get("Total Exported Frames", ""))
    refuse_cut_end(path, text, rows[-1], len(rows[top][1]), announced > len(data))
    check_size(path, len(data), len(markers))
    columns = [column for triple in markers.values() for column in triple]
    table = read_numbers(path, data, [0, 1, *columns])
    before, renumbered = frames_before(path, positive(data[0][1][0]) if data else 0.0, 0)
    rate = positive(about.get("Export Frame Rate") or about.get("Capture Frame Rate", ""))
    start = _start(rows[top][1], data, about, rate)
    raw = RawTake(
        path=path,
        labels=tuple(name for name, _ in markers),
        positions=table[:, 2:].reshape(len(data), len(markers), 3),
        seconds=table[:, 1],
        rate=rate,
        unit_name=about.get("Length Units", ""),
        assumed_unit="m",
        up_axis="Y",
        start_timecode=start,
        first_frame=before,
    )
    take, findings = finish_take(raw, options)
    if start and "TimeCode" not in rows[top][1]:
        findings.append(finding("TIMECODE_ASSUMED", str(path)))
    findings = renumbered + compare_frames(path, announced, len(data)) + findings
    if count := nameless_columns(["named"] * len(rows[top][1]), data):
        ignored.append(f"{count} columns without a header")
    if ignored:
        message = "only measured markers are read, not {channels}"
        findings.insert(0, finding("CHANNEL_IGNORED", str(path), message, ignored))
    return take, findings


def _columns(path: Path, header: list[Row]) -> tuple[dict[tuple[str, str], list[int]], list[str]]:
    """Return the x, y, z columns of each measured marker, and the names of other columns."""
    width = max(len(cells) for _, cells in header)
    full = [cells + [""] * (width - len(cells)) for _, cells in header]
    if len(full) < 4:
        raise InputError(
            f"{path}: rows are missing between metadata and data (type, name, quantity); "
            "export it as CSV again",
            "COLUMNS_WRONG",
        )
    types, names, quantities, axes = full[0], full[1], full[-2], full[-1]
    ids = full[2] if len(full) > 4 else [""] * width
    places: dict[tuple[str, str], dict[str, int]] = {}
    ignored: dict[str, None] = {}
    for column in range(2, width):
        if types[column] != "Marker" or quantities[column] != "Position":
            ignored[f"{types[column]} {names[column]} {quantities[column]}".strip()] = None
        elif axes[column] in ("X", "Y", "Z"):
            places.setdefault((names[column], ids[column]), {})[axes[column]] = column
    partial = [name for (name, _), xyz in places.items() if len(xyz) < 3]
    if partial:
        raise InputError(
            f"{path}: marker {partial[0]!r} lacks one of the columns X, Y, Z; export all three",
            "COLUMNS_WRONG",
        )
    if not places:
        raise InputError(
            f"{path}: there are no columns of type Marker; export with markers switched on",
            "COLUMNS_WRONG",
        )
    ignored.pop("", None)
    markers = {key: [xyz["X"], xyz["Y"], xyz["Z"]] for key, xyz in places.items()}
    return markers, list(ignored)


def _start(axes: list[str], data: list[Row], about: dict[str, str], rate: float) -> str:
    """Return the timecode of the first frame, from its column or from the time of day."""
    if not data:
        return ""
    first = data[0][1]
    if "TimeCode" in axes[: len(first)]:
        column = axes.index("TimeCode")
        return _with_fraction([cells[column] for _, cells in data if len(cells) > column])
    match = _START.fullmatch(about.get("Capture Start Time", ""))
    if match is None:
        return ""
    hour, minute, second = (int(field) for field in match.groups()[:3])
    if match[5]:
        hour = hour % 12 + (12 if match[5] == "P" else 0)
    fraction = float(f"0.{match[4] or 0}") + (positive(first[1]) if len(first) > 1 else 0.0)
    whole = int(fraction)
    clock = (hour * 3600 + minute * 60 + second + whole) % 86400
    frame = int((fraction - whole) * rate)
    return f"{clock // 3600:02d}:{clock // 60 % 60:02d}:{clock % 60:02d}:{frame:02d}"


def _with_fraction(timecodes: list[str]) -> str:
    """Return the first timecode, its subframe as a fraction: Motive counts the take's frames there.

    Source: OptiTrack documentation, "Timecode": HH:MM:SS:FF.Y, Y from 0 within each FF.
    """
    counted = [match for text in timecodes if (match := _SUBFRAMES.fullmatch(text))]
    if not counted or counted[0].string != timecodes[0] or not int(counted[0][2]):
        return timecodes[0]
    fraction = int(counted[0][2]) / (max(int(match[2]) for match in counted) + 1)
    return counted[0][1] + f"{fraction:.3f}".lstrip("0")
