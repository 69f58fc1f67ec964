"""Live Link Face CSV: ARKit blend shape weights with a timecode for each row.

The timecode reads HH:MM:SS:FF.sub: FF counts frames of the timecode's own base (60 in the
recordings seen, whatever the recording's rate), `.sub` is a decimal fraction of such a frame. With
``;`` before the frames it is drop-frame timecode, of 29.97 or 59.94 Hz, which leaves out the first
numbers of each minute but every tenth.
"""

import re
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError, errors_at
from usdface.findings import Finding, finding
from usdface.io.drop_frame import dropped_labels
from usdface.io.takes.missing_weights import WRITTEN, bridge_weights
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import (
    Row,
    delimiter_of,
    nameless_columns,
    read_numbers,
    read_rows,
    read_text,
    refuse_cut_table,
)
from usdface.io.takes.timing import take_times
from usdface.options import TakeOptions
from usdface.takes import WeightsTake, check_range

__all__ = ["read_livelink"]

_TIMECODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})[:;](\d{1,3}(?:\.\d{1,9})?)")
# Hz: SMPTE ST 12's, their doubles, and high frame rates.
_BASES = (24, 25, 30, 48, 50, 60, 100, 120)
_ASSUMED_BASE = 60  # that of all recordings seen
_NTSC = 1.001  # s, of as many frames as drop-frame timecode counts a second (SMPTE ST 12)
_DAY = 86400.0  # s
_ROTATION = ("Yaw", "Pitch", "Roll")
_HEAD = ("HeadYaw", "HeadPitch", "HeadRoll")
_EYES = ("LeftEye", "RightEye")
_HALF_TURN = 3.15  # rad, rounded up


def read_livelink(path: Path, options: TakeOptions = DEFAULTS) -> tuple[WeightsTake, list[Finding]]:
    """Read a Live Link Face CSV as weights, columns by name (`EyeBlinkLeft` -> `eyeBlinkLeft`).

    Rotations of the eyes are left out, which the curves of gaze say, too
    (`usdface.face.gaze_curves`), as are rows without weights (the face was lost), and those
    of the head if they are all 0. A weight that is missing in a row with others is bridged
    (WEIGHT_BRIDGED). Dropped frames stay gaps in the times; a recording may run over midnight.

    Raises
    ------
    InputError
        If the file is missing, cut off, not such a file, holds no row with weights, or its
        timecodes do not increase.
    """
    text = read_text(path)
    rows = read_rows(path, text, delimiter_of(text))
    header = rows[0][1]
    if [cell.lower() for cell in header[:2]] != ["timecode", "blendshapecount"]:
        raise InputError(
            f"{path} is not a Live Link Face file: expected the columns Timecode, BlendShapeCount",
            "COLUMNS_WRONG",
        )
    columns = [c for c, name in enumerate(header[2:], 2) if name and not name.endswith(_ROTATION)]
    if not columns:
        raise InputError(
            f"{path}: there are no blend shape columns; "
            "expected those of ARKit, eyeBlinkLeft and so on, after BlendShapeCount",
            "COLUMNS_WRONG",
        )
    if any(rows[-1][1][2:]):  # a row of a lost face has two cells
        refuse_cut_table(path, rows)
    kept, weights, findings = _rows_with_weights(path, rows[1:], columns)
    columns, weights, absent = _columns_with_weights(path, header, columns, weights)
    names = tuple(header[c][0].lower() + header[c][1:] for c in columns)
    findings += absent
    angles, new_findings = _head_angles(path, header, kept)
    findings += new_findings
    used = () if angles is None and not new_findings else _HEAD
    ignored = [name for name in header[2:] if name.endswith(_ROTATION) and name not in used]
    if ignored:
        of_eyes = all(name.startswith(_EYES) for name in ignored)
        why = ", as the curves of gaze say the same" if of_eyes else ""
        message = f"rotations that are not read{why}: {{channels}}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, ignored))
    if count := nameless_columns(header, rows[1:]):
        message = "not read: {channels}"
        unnamed = [f"{count} columns without a name"]
        findings.append(finding("CHANNEL_IGNORED", str(path), message, unnamed))
    seconds, base_findings = _seconds(path, kept)
    times, rate, time_findings = take_times(path, len(kept), seconds=seconds, override=options.rate)
    lines = [line for line, _ in kept]
    message = "no weight in line {lines}; bridged from the rows around it"
    findings += bridge_weights(path, names, times, weights, lines, message)
    with errors_at(path):
        head = None if angles is None else _head(times, angles)
        take = WeightsTake(names, times, weights, rate, kept[0][1][0], path.name, head)
        check_range(take)
    return take, findings + base_findings + time_findings


def _rows_with_weights(
    path: Path, rows: list[Row], columns: list[int]
) -> tuple[list[Row], FloatArray, list[Finding]]:
    """Return the rows with a weight, the weights (F, S), NaN where one is missing; findings."""
    weights = read_numbers(path, rows, columns)
    tracked = np.any(np.isfinite(weights), axis=1)
    kept = [row for row, seen in zip(rows, tracked, strict=True) if seen]
    if not kept:
        raise InputError(
            f"{path}: no row has blend shape weights; expected at least one", "TAKE_EMPTY"
        )
    empty = len(rows) - len(kept)
    if not empty:
        return kept, weights, []
    found = finding(
        "FRAME_EMPTY",
        str(path),
        "{empty_count} of {frame_count} rows hold no weights",
        empty,
        len(rows),
    )
    first = int(tracked.argmax())
    if not first:
        return kept, weights[tracked], [found]
    message = "time 0 is row {frame_number:g} of the file, as the face was lost in those before it"
    later = finding("FRAMES_RENUMBERED", str(path), message, first + 1)
    return kept, weights[tracked], [found, later]


def _columns_with_weights(
    path: Path, header: list[str], columns: list[int], weights: FloatArray
) -> tuple[list[int], FloatArray, list[Finding]]:
    """Leave out columns of which most weights are missing: bridges would be its motion."""
    written = np.isfinite(weights).mean(axis=0) >= WRITTEN
    if written.all():
        return columns, weights, []
    if not written.any():
        raise InputError(
            f"{path}: no curve has weights in half of the rows; expected at least one", "TAKE_EMPTY"
        )
    kept = [column for column, has in zip(columns, written, strict=True) if has]
    empty = [header[column] for column in columns if column not in kept]
    found = finding(
        "CHANNEL_IGNORED",
        str(path),
        "more than half of the rows have no weight of {channels}",
        empty,
    )
    return kept, weights[:, written], [found]


def _head_angles(
    path: Path, header: list[str], rows: list[Row]
) -> tuple[FloatArray | None, list[Finding]]:
    """Return yaw, pitch and roll of the head (F, 3) [rad], NaN where missing; None without them."""
    if not all(name in header for name in _HEAD):
        return None, []
    if repeated := next((name for name in _HEAD if header.count(name) > 1), None):
        raise InputError(f"{path}: there are two columns {repeated}; expected one", "NAME_REPEATED")
    angles = read_numbers(path, rows, [header.index(name) for name in _HEAD])
    missing = ~np.isfinite(angles).all(axis=1)
    angles[missing] = np.nan
    if 1.0 - missing.mean() < WRITTEN:
        return None, []
    if not np.nan_to_num(angles).any():
        message = "rotations that are 0 in every row, so the head stays still: {channels}"
        return None, [finding("CHANNEL_IGNORED", str(path), message, _HEAD)]
    if np.nanmax(np.abs(angles)) > _HALF_TURN:
        message = "angles of the head go up to {angle:.3g}, which are no radians; left out"
        largest = float(np.nanmax(np.abs(angles)))
        return None, [finding("CHANNEL_IGNORED", str(path), message, largest)]
    if not missing.any():
        return angles, []
    lines = [rows[row][0] for row in np.flatnonzero(missing)]
    message = "no rotation in line {lines}; bridged from the rows around it"
    return angles, [finding("WEIGHT_BRIDGED", f"{path}: head", message, lines)]


def _head(times: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the head's rotation vectors (F, 3) [rad], bridged where they are missing.

    Yaw is positive to the head's left, pitch up, roll to its right shoulder; those of the eyes have
    the other signs. In a recording of the app, of a head that is shaken while it looks at the
    phone, the eyes' angles are 0.8 and 0.9 times the head's: eyes that stay on the phone turn
    against the head.
    """
    from scipy.spatial.transform import Rotation  # costs more to import than most takes need

    known = ~np.isnan(angles[:, 0])
    yaw, pitch, roll = (np.interp(times, times[known], curve[known]) for curve in angles.T)
    turns = Rotation.from_euler("YXZ", np.stack([yaw, -pitch, roll], axis=1))
    return np.asarray(turns.as_rotvec())


def _seconds(path: Path, rows: list[Row]) -> tuple[FloatArray, list[Finding]]:
    """Return the time of each row (F,) [s], from the first row's midnight."""
    matches = [_TIMECODE.fullmatch(cells[0]) for _, cells in rows]
    for match, (line, cells) in zip(matches, rows, strict=True):
        if match is None:
            raise InputError(
                f"{path}, line {line}: {cells[0][:40]!r} is not a timecode HH:MM:SS:FF.sub"
                ", as Live Link Face writes it; was it edited?",
                "ROW_WRONG",
            )
    fields = np.array([match.groups() for match in matches if match], dtype=np.float64)
    clock = fields[:, :3] @ [3600.0, 60.0, 1.0]
    clock += _DAY * np.cumsum(np.diff(clock, prepend=clock[0]) < -_DAY / 2)
    base, findings = _timecode_base(path, clock.astype(np.int64), fields[:, 3])
    dropping = base % 30 == 0 and all(";" in cells[0] for _, cells in rows)
    if not dropping:
        return clock + fields[:, 3] / base, findings
    skipped = dropped_labels(clock // 60, base)
    return (clock + (fields[:, 3] - skipped) / base) * _NTSC, findings


def _timecode_base(path: Path, clock: IntArray, frames: FloatArray) -> tuple[int, list[Finding]]:
    """Return how many frames a second of the timecode has.

    Where the clock goes from one second to the next, the step in frames is
    ``base - before + after``: the right base makes it equal to the steps within seconds.
    """
    bases = [base for base in _BASES if base > frames.max()]
    if not bases:
        raise InputError(
            f"{path}: timecode frame {frames.max():g} is more than a second holds; "
            f"expected fewer than {_BASES[-1]}",
            "TIMES_WRONG",
        )
    steps = np.diff(frames)
    turns = np.diff(clock) == 1
    inside = steps[np.diff(clock) == 0]
    if not (turns.any() and len(inside)):
        base = _ASSUMED_BASE if _ASSUMED_BASE in bases else bases[0]
        message = "timecode frames taken as 1/{rate_hz} s: the take is too short to tell"
        return base, [finding("RATE_ASSUMED", str(path), message, base)]
    usual, turning = np.median(inside), np.median(steps[turns])
    return min(bases, key=lambda base: abs(float(turning + base - usual))), []
