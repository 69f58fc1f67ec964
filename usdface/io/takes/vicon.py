"""Marker text as Vicon exports it (Nexus and others: ASCII or CSV, comma or tab separated).

The file has sections, each with a title, its rate [Hz] and a table. In ``Trajectories`` a row
names the markers, ``subject:marker`` above the first of their columns; below it stand the axes
(``Frame, Sub Frame, X, Y, Z ...``), the units, then a row for each frame. Older programs
(Workstation) write titles in capitals, ``120,Hz``, ``Field #, X, Y, Z ...``, and no units.
"""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
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

__all__ = ["read_vicon"]

_TITLE = "trajectories"
_HEADER_ROWS = 5  # title, rate, names, axes, units
_OLD_FRAME, _OLD_HEADER_ROWS = "field #", 4  # without units


def read_vicon(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the trajectories of a Vicon text export; an empty cell = occluded.

    Other sections (devices, model outputs, joints, events) and derivatives of the trajectories are
    left out. The format names no up axis.

    Raises
    ------
    InputError
        If the file is missing, has no trajectories, is cut off, or holds no usable frame.
    """
    text = read_text(path)
    head = text.lstrip("\r\n")[:4096]  # titles alone have no delimiter
    rows = read_rows(path, text, max(",;\t", key=head.count))
    sections = _sections(rows)
    top = next((start for start in sections if rows[start][1][0].lower() == _TITLE), None)
    if top is None:
        titles = ", ".join(rows[start][1][0][:40] for start in sections[:5]) or "none"
        raise InputError(
            f"{path}: the section 'Trajectories' is missing; found {titles}: "
            "export trajectories, too",
            "COLUMNS_WRONG",
        )
    end = min((start for start in sections if start > top), default=len(rows))
    section, ignored = rows[top:end], [rows[start][1][0] for start in sections if start != top]
    is_old = len(section) > 3 and section[3][1][0].lower() == _OLD_FRAME
    header_rows = _OLD_HEADER_ROWS if is_old else _HEADER_ROWS
    if not is_old and (
        len(section) < header_rows
        or section[3][1][0].lower() != "frame"
        or section[4][1][0].isdecimal()  # a frame, where units are expected
    ):
        raise InputError(
            f"{path}, line {section[0][0]}: expected rate, names, the row "
            "'Frame, Sub Frame, X, Y, Z ...' and units below 'Trajectories'; export it again",
            "COLUMNS_WRONG",
        )
    markers, others = _columns(path, section)
    frames = section[header_rows:]
    units = [] if is_old else section[4][1]
    if end == len(rows) and frames:
        refuse_cut_end(path, text, frames[-1], len(section[3][1]), rows_missing=False)
    check_size(path, len(frames), len(markers))
    columns = [x + axis for _, x in markers for axis in range(3)]
    table = read_numbers(path, frames, [0, *columns])
    first = positive(frames[0][1][0]) if frames else 0.0
    before, findings = frames_before(path, first, 1)
    if ignored or others:
        message = "only the positions of markers are read, not {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, [*ignored, *others]))
    raw = RawTake(
        path=path,
        labels=tuple(name for name, _ in markers),
        positions=table[:, 1:].reshape(len(frames), len(markers), 3),
        frames=table[:, 0],
        rate=positive(section[1][1][0]),
        unit_name=next((unit for unit in units if unit), ""),
        first_frame=before,
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + take_findings


def _sections(rows: list[Row]) -> list[int]:
    """Return where sections start: a row with a title alone above a row with a rate alone.

    Older programs name the unit of the rate beside it.
    """
    alone = [[cell for cell in cells if cell and cell.lower() != "hz"] for _, cells in rows]
    return [
        k
        for k in range(len(rows) - 1)
        if len(alone[k]) == 1 == len(alone[k + 1])
        and not positive(alone[k][0])
        and rows[k][1][0]
        and positive(rows[k + 1][1][0])
    ]


def _columns(path: Path, section: list[Row]) -> tuple[list[tuple[str, int]], list[str]]:
    """Return the name and x column of each marker, y and z next to it; names of other columns."""
    axes = section[3][1]
    names = section[2][1] + [""] * len(axes)
    markers: list[tuple[str, int]] = []
    others: dict[str, None] = {}
    name, column = "", 1 + (axes[1:2] == ["Sub Frame"])
    while column < len(axes):
        name = names[column] or name
        if [axis.upper() for axis in axes[column : column + 3]] == ["X", "Y", "Z"]:
            markers.append((name, column))
            column += 3
            continue
        if axes[column]:
            others[f"{name} {axes[column]}".strip()] = None
        column += 1
    if not markers:
        raise InputError(
            f"{path}, line {section[3][0]}: no marker has columns X, Y, Z; export it again",
            "COLUMNS_WRONG",
        )
    return markers, list(others)
