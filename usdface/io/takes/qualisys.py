"""Marker text as Qualisys Track Manager exports it: TSV of 3D data, with its header.

Lines ``KEYWORD<tab>value ...`` come first, the last of them ``MARKER_NAMES`` and perhaps
``TRAJECTORY_TYPES``; then perhaps a row of column names, and a row for each frame: perhaps its
number, time [s] and timecode, and x, y, z of each marker [mm]
(https://docs.qualisys.com/qtm/content/processing_measurement/motion_data_tsv.htm).
"""

from pathlib import Path

from usdface.arrays import FloatArray
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

__all__ = ["read_qualisys"]


def read_qualisys(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a TSV file of Qualisys Track Manager; an empty cell or ``null`` = occluded.

    The format names no up axis. Its time stamp is not that of the first frame, so no start timecode
    is read.

    Raises
    ------
    InputError
        If the file is missing, holds no 3D data, is cut off, or holds no usable frame.
    """
    text = read_text(path)
    rows = read_rows(path, text, "\t")
    header, frames, headings = _parts(path, rows)
    about = {cells[0]: cells[1:] for cells in header}
    labels, columns, findings = _markers(path, about, frames, headings)
    announced = positive(_value(about, "NO_OF_FRAMES"))
    if frames:
        refuse_cut_end(path, text, frames[-1], columns.stop, announced > len(frames))
    check_size(path, len(frames), len(labels))
    table = read_numbers(path, frames, columns)
    seconds, numbers, ignored = _times(path, frames, headings, columns.start)
    before, renumbered = frames_before(path, numbers[0], 1) if numbers is not None else (0, [])
    ignored += ["events"] * any(cells[0] == "EVENT" for cells in header)
    if ignored:
        message = "only the positions of markers are read, not {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, ignored))
    raw = RawTake(
        path=path,
        labels=labels,
        positions=table.reshape(len(frames), len(labels), 3),
        seconds=seconds,
        frames=numbers,
        rate=positive(_value(about, "FREQUENCY")),
        unit_name="mm",
        first_frame=before,
    )
    findings += renumbered + compare_frames(path, announced, len(frames))
    take, take_findings = finish_take(raw, options)
    return take, findings + take_findings


def _parts(path: Path, rows: list[Row]) -> tuple[list[list[str]], list[Row], list[str]]:
    """Return the cells of the header, the rows of frames, and the names of columns, if any.

    Raises
    ------
    InputError
        If there are no names of markers.
    """
    words = [cells[0] for _, cells in rows]
    if "MARKER_NAMES" not in words:
        kind = next(
            (cells[1] for _, cells in rows if cells[0] == "DATA_INCLUDED" and cells[1:]), ""
        )
        found = f"{kind[:40]} data" if kind else "a header without MARKER_NAMES"
        raise InputError(
            f"{path}: expected 3D data; found {found}: export 3D data as TSV, with its header",
            "COLUMNS_WRONG",
        )
    top = words.index("MARKER_NAMES") + 1
    top += words[top : top + 1] == ["TRAJECTORY_TYPES"]
    header, frames = [cells for _, cells in rows[:top]], rows[top:]
    headings: list[str] = []
    if frames and any(cell.upper().endswith(" X") for cell in frames[0][1]):
        headings, frames = frames[0][1], frames[1:]
    return header, frames, headings


def _value(about: dict[str, list[str]], keyword: str) -> str:
    return next(iter(about.get(keyword, [])), "")


def _markers(
    path: Path, about: dict[str, list[str]], frames: list[Row], headings: list[str]
) -> tuple[tuple[str, ...], range, list[Finding]]:
    """Return the labels, "" where a marker has columns and none, their columns, and findings.

    Raises
    ------
    InputError
        If the rows of frames do not have three columns for each name.
    """
    names = list(about["MARKER_NAMES"])
    while names and not names[-1]:
        names.pop()
    width = _width(frames)
    before = next((k for k, cell in enumerate(headings) if cell.upper().endswith(" X")), None)
    if before is None:
        before = width - 3 * len(names)
        coded = before == 3 and any(":" in cell for cell in frames[0][1][2:3])
        before = before if 0 <= before <= 2 or coded else width % 3
    count = (width - before) // 3
    if frames and (count < len(names) or width != before + 3 * count):
        raise InputError(
            f"{path}, line {frames[0][0]}: expected x, y, z of {len(names)} markers, perhaps after "
            f"frame and time; found {width} columns: export it again",
            "COLUMNS_WRONG",
        )
    labels = tuple(names + [""] * (count - len(names)))
    announced = positive(_value(about, "NO_OF_MARKERS"))
    findings = []
    if announced and announced != len(labels):
        message = "the header announces {expected_count:g} markers, the file holds {marker_count}"
        where = str(path)
        findings.append(finding("MARKERS_MISCOUNTED", where, message, announced, len(labels)))
    return labels, range(before, before + 3 * len(labels)), findings


def _width(frames: list[Row]) -> int:
    """Return the number of columns, without the one that a tab at the end of each row makes.

    Markers that are never seen leave three empty columns each.
    """
    width = max((len(cells) for _, cells in frames), default=0)
    filled = max((1 + k for _, cells in frames for k, cell in enumerate(cells) if cell), default=0)
    return width - ((width - filled) % 3 == 1)


def _times(
    path: Path, frames: list[Row], headings: list[str], count: int
) -> tuple[FloatArray | None, FloatArray | None, list[str]]:
    """Return times [s] and numbers of the frames, each (F,) or None, and names of other columns.

    They stand in the `count` columns before those of the markers.
    """
    names = (headings or ["Frame", "Time", "SMPTE"])[:count]
    table = {
        name.lower(): column
        for column, name in enumerate(names)
        if name.lower() in ("frame", "time")
    }
    values = {
        name: read_numbers(path, frames, [column])[:, 0] for name, column in table.items() if frames
    }
    others = [name for name in names if name.lower() not in table]
    return values.get("time"), values.get("frame"), others
