"""Face landmarks of MediaPipe, which has no file of its own: JSON and CSV as people write them.

x and y run from 0 to 1 of the image's width and height, from the top left corner; z is not read.

* JSON: a list of frames, or an object that has one as ``frames``. A frame is a list of landmarks,
  or an object that has one as ``landmarks``, ``face_landmarks`` or ``faceLandmarks``, and perhaps
  ``frame`` and ``timestamp_ms``. A landmark is ``{"x", "y", "z"}`` or ``[x, y, z]``. The object may
  have ``width``, ``height`` and ``fps``. Where more frames have blend shapes than landmarks, those
  are read (`usdface.io.takes.mediapipe_shapes`).
* CSV, a row for each landmark: ``frame, landmark, x, y`` (``landmark_id``, ``landmark_index``);
  or a row for each frame: ``x_0, y_0, ...``, ``0_x, 0_y, ...`` or ``landmark_0_x, ...``; and
  perhaps ``timestamp_ms`` and ``face`` (``face_id``, ``face_index``).

Of several faces that of most frames is read.
"""

import re
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, needed_image_size, normalised
from usdface.io.takes.json_text import number, read_json
from usdface.io.takes.mediapipe_faces import LANDMARKS, faces_of, main_faces, place_of
from usdface.io.takes.mediapipe_shapes import SHAPES, read_scores, score_faces, scores_take
from usdface.io.takes.raw_take import DEFAULTS, check_size
from usdface.io.takes.several_faces import rows_of_face
from usdface.io.takes.text_table import Row, read_numbers, read_table
from usdface.io.takes.track_text import TrackTable
from usdface.io.takes.wide_tracks import samples_of_columns
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_mediapipe"]

_FRAME = ("frame", "frame_index", "frame_idx", "frame_number", "frame_id")
_LANDMARK = ("landmark", "landmark_index", "landmark_idx", "landmark_id", "landmark_name")
_FRAMES = ("frames", "results", "data")
_OF_FILE = (*_FRAMES, "fps", "width", "height", "image_width", "image_height")
_FACE = ("face", "face_id", "face_index", "face_idx")
_TIME = "timestamp_ms"
_WIDE = re.compile(r"(?:(?:landmark|lm|point)?_?(\d{1,4})[_.]([xy])|([xy])_?(\d{1,4}))")
_TIMES_LACKING = "timestamp_ms, which some frames lack"
_MOST = 10_000  # landmarks of a face; MediaPipe's has 478


def read_mediapipe(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read the landmarks of one face, or its blend shapes where more frames have these.

    A frame without landmarks is occluded.

    Raises
    ------
    InputError
        If the file is missing or of none of the forms above, or the size of the image is not known.
    """
    width = height = rate = 0.0
    unread: list[str] = []
    if path.suffix.lower() == ".json":
        document = read_json(path)
        frames = _frames(path, document)
        scores = [read_scores(each) for each in frames]
        if sum(map(bool, scores)) > sum(bool(faces_of(each)) for each in frames):
            return _of_scores(path, document, frames, scores, options)
        table, times, left_out = _of_frames(path, frames)
        unread = _unread_of_frames(frames)
        if times is None and any(_has_time(frame) for frame in frames):
            unread.append(_TIMES_LACKING)
        unread += _unread_of_file(document)
        if isinstance(document, dict):
            sides = (document.get(f"{p}{s}") for s in ("width", "height") for p in ("", "image_"))
            found = [side for side in map(number, sides) if side > 0]
            width, height = found[:2] if len(found) == 2 else (0.0, 0.0)
            rate = _rate(document)
    else:
        rows = read_table(path)
        table, times, left_out = _of_rows(path, rows)
        unread = _unread_columns(rows[0][1])
    places = normalised(path, table.numbers[:, 1:3], "MediaPipe")
    size = needed_image_size(path, options, "0 to 1", width, height)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=np.asarray(places * size),
        origin="top",
        first_frame=0,
        image_size=size,
        seconds=times,
        rate=rate,
        ignored=["z", *unread],
    )
    take, findings = finish_tracks(tracks, options)
    return take, left_out + findings


def _of_scores(
    path: Path,
    document: Any,
    frames: Sequence[Any],
    scores: Sequence[Mapping[str, float]],
    options: TakeOptions,
) -> tuple[WeightsTake, list[Finding]]:
    """Return the take of the blend shapes, and the other contents of frames."""
    seconds = np.array([_time(frame) for frame in frames])
    numbers = np.array([_frame_number(frame, index) for index, frame in enumerate(frames)])
    take, findings = scores_take(path, scores, seconds, numbers, _rate(document), options.rate)
    unread = [name for name in _unread_of_frames(frames) if name not in SHAPES]
    if any(map(faces_of, frames)):
        unread.append("landmarks, which fewer frames have")
    if count := sum(score_faces(frame) > 1 for frame in frames):
        message = (
            "{frame_count} frames have blend shapes of several faces, in any order; the first of "
            "each is read, and may be another person: leave only the performer's in the file"
        )
        findings.append(finding("FACES_LEFT_OUT", str(path), message, count))
    stamped = [_has_time(frame) for frame, own in zip(frames, scores, strict=True) if own]
    if any(stamped) and not all(stamped):
        unread.append(_TIMES_LACKING)
    unread += _unread_of_file(document)
    if unread:
        findings.append(finding("CHANNEL_IGNORED", str(path), "not read: {channels}", unread))
    return take, findings


def _rate(document: Any) -> float:
    """Return the frame rate that a document names [Hz]; 0 = none."""
    named = document.get("fps") if isinstance(document, dict) else None
    return float(np.nan_to_num(number(named), posinf=0.0, neginf=0.0))


def _frame_number(frame: Any, index: int) -> float:
    """Return the number of a frame, NaN if it is none; `index` where it has no entry for it."""
    known = frame if isinstance(frame, dict) else {}
    return next((number(known[key]) for key in _FRAME if key in known), float(index))


def _time(frame: Any) -> float:
    """Return the time of a frame [s]; NaN = none."""
    return number(frame.get("timestamp_ms") if isinstance(frame, dict) else None) / 1000


def _frames(path: Path, document: Any) -> list[Any]:
    frames = document
    if isinstance(document, dict):
        frames = next((document[key] for key in _FRAMES if key in document), None)
    if not isinstance(frames, list):
        found = "an object without one" if isinstance(document, dict) else f"{document!r:.40}"
        raise InputError(
            f"{path}: no landmarks of MediaPipe; expected a list of frames, or an object that has "
            f"one as {_FRAMES[0]!r}; found {found}",
            "SCHEMA_BROKEN",
        )
    return frames


def _of_frames(
    path: Path, frames: Sequence[Any]
) -> tuple[TrackTable, FloatArray | None, list[Finding]]:
    """Return the samples of one face, the time of each [s] where frames have times, findings."""
    faces, left_out = main_faces(path, frames)
    count = max(map(len, faces), default=0)
    if not count:
        raise InputError(
            f"{path}: no frame has landmarks or blend shapes; "
            "expected a face in one frame at least: is it in the picture?",
            "TAKE_EMPTY",
        )
    if count > _MOST:
        raise InputError(f"{path}: {count} landmarks; expected up to {_MOST}", "TOO_LARGE")
    check_size(path, len(frames), count)
    numbers = np.full((len(frames), count, 3), np.nan)
    seconds = np.full(len(frames), np.nan)
    for index, (frame, face) in enumerate(zip(frames, faces, strict=True)):
        numbers[index, :, 0] = _frame_number(frame, index)
        seconds[index] = _time(frame)
        if face:
            numbers[index, : len(face), 1:] = [place_of(landmark) for landmark in face]
    table = TrackTable(
        tuple(f"landmark_{n}" for n in range(count)),
        np.tile(np.arange(count), len(frames)),
        numbers.reshape(-1, 3),
        (),
    )
    times = np.repeat(seconds, count) if np.isfinite(seconds).all() else None
    return table, times, left_out


def _unread_of_frames(frames: Sequence[Any]) -> list[str]:
    """Return the contents of frames beside the landmarks of one face, as its blend shapes."""
    known = {*LANDMARKS, *_FRAME, "timestamp_ms"}
    objects = [frame for frame in frames if isinstance(frame, dict)]
    found = {str(key): None for frame in objects for key in frame if key not in known}
    marks = (landmark for frame in frames for face in faces_of(frame) for landmark in face[:1])
    named = (mark for mark in marks if isinstance(mark, dict))
    found |= {str(key): None for mark in named for key in mark if key not in ("x", "y", "z")}
    return [*found]


def _unread_of_file(document: Any) -> list[str]:
    """Return the contents of a document beside its frames, their rate and size."""
    return [key for key in document if key not in _OF_FILE] if isinstance(document, dict) else []


def _has_time(frame: Any) -> bool:
    return isinstance(frame, dict) and np.isfinite(number(frame.get("timestamp_ms")))


def _unread_columns(header: Sequence[str]) -> list[str]:
    """Return the columns of a table that are no frame, landmark or place."""
    known = {*_FRAME, *_LANDMARK, *_FACE, _TIME, "x", "y", "z"}
    names = [name for name in header if name and name.lower() not in known]
    # z stands where x does.
    return [name for name in names if not _WIDE.fullmatch(name.lower().replace("z", "x"))]


def _of_rows(path: Path, rows: list[Row]) -> tuple[TrackTable, FloatArray | None, list[Finding]]:
    """Return the samples of one face, the time of each [s] where rows have times, findings."""
    header = [name.lower() for name in rows[0][1]]
    columns = {name: column for column, name in reversed(list(enumerate(header)))}
    frame = next((columns[name] for name in _FRAME if name in columns), -1)
    landmark = next((columns[name] for name in _LANDMARK if name in columns), -1)
    face = next((columns[name] for name in _FACE if name in columns), None)
    place = next((n for n, name in enumerate(header) if name == "x" or _WIDE.fullmatch(name)), -1)

    def seen(cells: list[str]) -> bool:
        return any(map(_is_finite, cells[place : place + 1]))

    # Rows of one time are of one frame, where frames have no numbers.
    image = frame if frame >= 0 else columns.get(_TIME, -1)
    mine, findings = rows_of_face(path, rows[1:], face, image, seen)
    if face is not None and image < 0 and (findings or all(seen(cells) for _, cells in mine)):
        findings.append(finding("FRAMES_UNNUMBERED", str(path)))
    if landmark >= 0 and {"x", "y"} <= columns.keys():
        table = _long(path, mine, frame, landmark, columns)
    else:
        table = _wide(path, mine, frame, columns)
    if _TIME not in columns:
        return table, None, findings
    clock = read_numbers(path, mine, [columns[_TIME]])[:, 0] / 1000.0
    return table, np.repeat(clock, len(table.frames) // max(len(mine), 1)), findings


def _is_finite(cell: str) -> bool:
    try:
        return isfinite(float(cell))
    except ValueError:
        return False


def _wide(path: Path, rows: Sequence[Row], frame: int, columns: Mapping[str, int]) -> TrackTable:
    points: dict[int, dict[str, int]] = {}
    for name, column in columns.items():
        if match := _WIDE.fullmatch(name):
            points.setdefault(int(match[1] or match[4]), {})[match[2] or match[3]] = column
    whole = {n: axes for n, axes in sorted(points.items()) if len(axes) == 2}
    if not whole:
        raise InputError(
            f"{path}: expected the columns frame, landmark, x, y or x_0, y_0, x_1, ...",
            "COLUMNS_WRONG",
        )
    points_of = [(f"landmark_{n}", [axes["x"], axes["y"]]) for n, axes in whole.items()]
    return samples_of_columns(path, rows, frame, points_of)


def _long(
    path: Path, rows: Sequence[Row], frame: int, landmark: int, columns: Mapping[str, int]
) -> TrackTable:
    if frame < 0:
        raise InputError(
            f"{path}: there is no column frame; expected frame, landmark, x, y", "COLUMNS_WRONG"
        )
    for line, cells in rows:
        if len(cells) <= landmark:
            raise InputError(
                f"{path}, line {line}: the row is too short; "
                "expected as many cells as columns; export or copy it again",
                "ROW_WRONG",
            )
    names = [cells[landmark] for _, cells in rows]
    index = {name: n for n, name in enumerate(dict.fromkeys(names))}
    labels = tuple(f"landmark_{name}" if name.isdecimal() else name for name in index)
    tracks = np.array([index[name] for name in names], dtype=np.int64)
    numbers = read_numbers(path, rows, [frame, columns["x"], columns["y"]])
    return TrackTable(labels, tracks, numbers, [line for line, _ in rows])
