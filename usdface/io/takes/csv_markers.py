"""Marker positions in plain CSV tables, long or wide, in space or in an image.

Long: one row a position, columns ``frame`` and/or ``time`` [s] or ``time_ms``, ``marker``, ``x``,
``y`` and perhaps ``z``. Wide: one row a frame, ``A_x``, ``A.x``, ``A:x`` or ``A X`` for each marker
and axis. Without z the positions are pixels of an image, y down.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.first_frame import frames_before
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.repeated_samples import first_repeat
from usdface.io.takes.text_table import (
    Row,
    nameless_columns,
    read_numbers,
    read_table,
)
from usdface.options import TakeOptions
from usdface.plain_text import listed
from usdface.takes import MarkerTake

__all__ = ["read_csv_markers"]

_FRAME = frozenset({"frame", "frames", "frame#", "frame_index", "frame index", "frame_number"})
_TIME = frozenset({"time", "time_s", "seconds", "timestamp", "t"})
_MILLISECONDS = frozenset({"time_ms", "t_ms", "timestamp_ms", "milliseconds"})
_MARKER = frozenset({"marker", "name", "label", "marker_name"})
_COMPONENT = re.compile(r"(.+)[ _.:]([xyz])", re.IGNORECASE)
# Ends of labels whose x, y and z are no place, as of rigid bodies.
_NO_PLACE = re.compile(
    r"(^|[ _.:])(rot|rotation|quat|quaternion|euler|scale|velocity|acceleration)$", re.IGNORECASE
)
_SAME_TIME = 1e-6  # s
_UNIT_SUFFIX = re.compile(r"\s*[\[(](s|sec|seconds)[\])]$")
_MILLISECONDS_SUFFIX = re.compile(r"\s*[\[(](ms|msec|milliseconds)[\])]$")


def read_csv_markers(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake, list[Finding]]:
    """Read a long or wide table of markers, separated by commas, semicolons or tabs.

    An empty cell, or in a long table a position that is not there, = occluded. Without a
    time column the frame numbers count at the rate of the options.

    Raises
    ------
    InputError
        If the file is missing, cut off or no such table, a cell is not a number, a marker lacks an
        axis or has two positions in a frame.
    """
    rows = read_table(path)
    header = [
        _MILLISECONDS_SUFFIX.sub("_ms", _UNIT_SUFFIX.sub("", cell.lower())) for cell in rows[0][1]
    ]
    columns = {name: i for i, name in reversed(list(enumerate(header)))}
    long = {"x", "y"} <= columns.keys() and not _MARKER.isdisjoint(columns)
    raw, ignored = (_long if long else _wide)(path, rows, columns)
    if count := nameless_columns(rows[0][1], rows[1:]):
        ignored.append(f"{count} without a name")
    take, findings = finish_take(raw, options)
    findings = [*_report_start(raw), *findings]
    if ignored:
        message = "columns that are no positions are not read: {channels}"
        findings.insert(0, finding("CHANNEL_IGNORED", str(path), message, ignored))
    nameless = _nameless_positions(rows[1:], columns) if long else 0
    if nameless:
        lost = [f"{nameless} positions without the name of a marker"]
        findings.insert(0, finding("CHANNEL_IGNORED", str(path), "not read: {channels}", lost))
    return take, findings


def _report_start(raw: RawTake) -> list[Finding]:
    """Return FRAMES_RENUMBERED unless the table begins at frame 0 or 1 and at the time of that."""
    if raw.first_frame > 1 or raw.seconds is None:
        return frames_before(raw.path, raw.first_frame, 1)[1]
    first = float(raw.seconds[0])
    # Some recorders count from frame 1, a step after 0 s.
    step = float(np.diff(raw.seconds[:2]).sum()) if raw.first_frame == 1 else 0.0
    if first == 0.0 or abs(first - step) < 0.5 * step:
        return []
    message = "time 0 is {seconds:g} s of the recording"
    return [finding("FRAMES_RENUMBERED", str(raw.path), message, first)]


def _nameless_positions(rows: list[Row], columns: dict[str, int]) -> int:
    """Return how many rows of a long table have a position, and no name of a marker."""
    name, x = _column(columns, _MARKER) or 0, columns["x"]
    full = (cells for _, cells in rows if len(cells) > max(name, x))
    return sum(not cells[name] and bool(cells[x]) for cells in full)


def _long(path: Path, rows: list[Row], columns: dict[str, int]) -> tuple[RawTake, list[str]]:
    axes = [axis for axis in "xyz" if axis in columns]
    marker = _column(columns, _MARKER)
    clocks = [c for c in (_column(columns, _FRAME), _time_column(columns)) if c is not None]
    if marker is None or not clocks:
        raise InputError(
            f"{path}: a table of positions needs a column 'frame' or 'time'; "
            "name the one that counts frames, or holds seconds",
            "COLUMNS_WRONG",
        )
    data = [row for row in rows[1:] if len(row[1]) > marker and row[1][marker]]
    if not data:
        raise InputError(
            f"{path}: there are no frames of data; expected at least one", "TAKE_EMPTY"
        )
    table = read_numbers(path, data, [*clocks, *(columns[axis] for axis in axes)])
    table[:, len(clocks) - 1] /= _units_of_clock(columns)
    if not np.isfinite(table[:, 0]).all():
        line = data[int(np.argmin(np.isfinite(table[:, 0])))][0]
        raise InputError(
            f"{path}, line {line}: the position has no frame or time; "
            "fill in the cell, or delete the row",
            "ROW_WRONG",
        )
    moments, first, frame = np.unique(table[:, 0], return_index=True, return_inverse=True)
    labels = tuple(dict.fromkeys(cells[marker] for _, cells in data))
    places = {label: i for i, label in enumerate(labels)}
    column = np.array([places[cells[marker]] for _, cells in data])
    check_size(path, len(moments), len(labels))
    _refuse_repeats(path, data, frame * len(labels) + column)
    positions = np.full((len(moments), len(labels), len(axes)), np.nan)
    positions[frame, column] = table[:, len(clocks) :]
    used = {marker, *clocks, *(columns[axis] for axis in axes)}
    times = table[first, : len(clocks)]
    ignored = [name for k, name in enumerate(rows[0][1]) if name and k not in used]
    if (np.abs(table[:, : len(clocks)] - times[frame]) > _SAME_TIME).any():
        ignored.append("times of a frame after its first")
    return _raw(path, labels, positions, times, columns), ignored


def _of_weights(header: Sequence[str]) -> str:
    """Return the remedy for a table of blend shape weights; "" for any other."""
    known = {name.lower() for name in ("jawOpen", "eyeBlinkLeft", "eyeBlink_L", "mouthSmileLeft")}
    if known.isdisjoint(name.lower() for name in header):
        return ""
    return (
        "; weights of blend shapes are read with the columns Timecode (HH:MM:SS:FF) and "
        "BlendShapeCount before them, as Live Link Face writes them"
    )


def _wide(path: Path, rows: list[Row], columns: dict[str, int]) -> tuple[RawTake, list[str]]:
    clocks = [c for c in (_column(columns, _FRAME), _time_column(columns)) if c is not None]
    places: dict[str, dict[str, int]] = {}
    ignored = []
    for column, name in enumerate(rows[0][1]):
        match = _COMPONENT.fullmatch(name)
        if match and not _NO_PLACE.search(match[1]):
            axes = places.setdefault(match[1], {})
            if match[2].lower() in axes:
                raise InputError(
                    f"{path}: column {name!r} occurs twice; rename or delete one of them",
                    "COLUMNS_WRONG",
                )
            axes[match[2].lower()] = column
        elif name and column not in clocks:
            ignored.append(name)
    if not places:
        raise InputError(
            f"{path} is no table of markers: expected columns frame or time, marker, x, y, z, "
            f"or time, A_x, A_y, A_z; found {listed(rows[0][1], 5)[:200]}{_of_weights(rows[0][1])}",
            "COLUMNS_WRONG",
        )
    wanted = "xyz" if any("z" in axes for axes in places.values()) else "xy"
    for label, axes in places.items():
        missing = [axis for axis in wanted if axis not in axes]
        if missing:
            raise InputError(
                f"{path}: marker {label!r} has no column for {missing[0]}; "
                "expected A_x, A_y and, in space, A_z",
                "COLUMNS_WRONG",
            )
    data = rows[1:]
    check_size(path, len(data), len(places))
    picked = [axes[axis] for axes in places.values() for axis in wanted]
    table = read_numbers(path, data, [*clocks, *picked])
    if clocks:
        table[:, len(clocks) - 1] /= _units_of_clock(columns)
    positions = table[:, len(clocks) :].reshape(len(data), len(places), len(wanted))
    return _raw(path, tuple(places), positions, table[:, : len(clocks)], columns), ignored


def _raw(
    path: Path,
    labels: tuple[str, ...],
    positions: FloatArray,
    clocks: FloatArray,
    columns: dict[str, int],
) -> RawTake:
    timed = _time_column(columns) is not None
    numbered = bool(clocks.size) and _column(columns, _FRAME) is not None
    return RawTake(
        path=path,
        labels=labels,
        positions=positions,
        seconds=clocks[:, -1] if timed else None,
        frames=clocks[:, 0] if numbered and not timed else None,
        first_frame=int(clocks[0, 0]) if numbered and abs(clocks[0, 0]) < 1 << 31 else 0,
    )


def _column(columns: dict[str, int], names: frozenset[str]) -> int | None:
    return next((c for name, c in columns.items() if name in names), None)


def _time_column(columns: dict[str, int]) -> int | None:
    seconds = _column(columns, _TIME)
    return _column(columns, _MILLISECONDS) if seconds is None else seconds


def _units_of_clock(columns: dict[str, int]) -> float:
    """Return the units in a second of a time, the last clock; 1 of frame numbers alone."""
    in_milliseconds = _column(columns, _TIME) is None and _time_column(columns) is not None
    return 1000.0 if in_milliseconds else 1.0


def _refuse_repeats(path: Path, data: list[Row], cells: IntArray) -> None:
    at = first_repeat(cells)
    if at is not None:
        raise InputError(
            f"{path}, line {data[at][0]}: this marker has a second position in one frame; "
            "delete one of the two",
            "ROW_WRONG",
        )
