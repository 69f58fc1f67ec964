"""The calibration file, JSON: the gain of each movement of a performer.

::

    {"shapes": {"jawOpen": {"gain": 1.12, "deviation": 0.03, "offset": 0.0},
                "mouthSmile_L": {"gain": 0.84}}}

Only `gain` counts, and `offset` if there is one; other keys of a blend shape are comments. A file
that `usdface calibrate` wrote has the performer's face, too, in metres::

    {"shapes": {...},
     "face": {"frames": 30,
              "markers": {"chin": {"point": 812, "shift": [0.0, 0.001, 0.0],
                                   "rest": [0.01, 1.52, 0.11]}, ...},
              "displacements": {"jawOpen": [[0.0, -0.021, 0.002], ...], ...}},
     "fingerprint": "3f0c..."}

with a displacement for each marker, in their order. The fingerprint tells whether the file was
edited since (`usdface.io.json_fingerprint`); a reader needs none.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError, did_you_mean, errors_at
from usdface.io.json_fingerprint import FINGERPRINT, sign
from usdface.io.json_values import checked_object, whole_number
from usdface.io.takes.text_table import read_text
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace

__all__ = ["calibration_json", "read_calibration_file"]

_LARGEST = 16_000_000  # bytes
_COUNT, _COMMENTS = ("gain", "offset"), ("deviation", "peak")
_MOST_POINTS = 2**53
_PLACES = 7  # of metres: far below the noise of any marker
_DIGITS = 4  # of a gain; a hundredth of its usual deviation (PERFORMER_GAIN_SPREAD)


def read_calibration_file(path: Path) -> Calibration:
    """Read a calibration.

    Raises
    ------
    InputError
        If the file is missing or not of the form above; the message names the blend shape.
    """
    if path.is_file() and path.stat().st_size > _LARGEST:
        raise InputError(
            f"{path} is larger than any calibration; expected a small JSON file", "TOO_LARGE"
        )
    try:
        document = json.loads(
            read_text(path), object_pairs_hook=checked_object, parse_int=whole_number
        )
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no JSON that can be read: {error}", "FILE_UNREADABLE"
        ) from error
    shapes = document.get("shapes") if isinstance(document, dict) else None
    if not isinstance(shapes, dict):
        raise InputError(
            f'{path}: expected {{"shapes": {{"jawOpen": {{"gain": 1.1}}, ...}}}}', "SCHEMA_BROKEN"
        )
    for name, entry in shapes.items():
        _refuse_misspelt(path, name, entry)
    gains = [_number(path, name, entry, "gain", 1.0) for name, entry in shapes.items()]
    offsets = [_number(path, name, entry, "offset", 0.0) for name, entry in shapes.items()]
    with errors_at(path):
        face = _face(document["face"]) if document.get("face") is not None else None
        return Calibration(tuple(shapes), np.array(gains), np.array(offsets), face)


def _face(entry: Any) -> PerformerFace:
    """Return the performer's face; its arrays are checked where it is made."""
    try:
        frames, markers, moved = (entry[key] for key in ("frames", "markers", "displacements"))
        points = [marker["point"] for marker in markers.values()]
        if not all(type(point) is int and 0 <= point < _MOST_POINTS for point in points):
            raise ValueError("a point is no index")
        if type(frames) is not int or not isinstance(moved, dict):
            raise TypeError("frames or displacements are of another type")
        return PerformerFace(
            tuple(markers),
            np.array(points, dtype=np.int64),
            _vectors([marker["shift"] for marker in markers.values()], 1),
            _vectors([marker["rest"] for marker in markers.values()], 1),
            frames,
            tuple(moved),
            _vectors(list(moved.values()), 2, len(markers)),
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            'the performer\'s face is not of the form {"frames": 30, "markers": {"chin": '
            '{"point": 812, "shift": [0, 0, 0], "rest": [0, 0, 0]}}, "displacements": '
            '{"jawOpen": [[0, 0, 0]]}}; run `usdface calibrate` again, or leave "face" out',
            "SCHEMA_BROKEN",
        ) from error


def _vectors(rows: list[object], axes: int, count: int = 0) -> FloatArray:
    """Return vectors (N, 3), or rows of `count` of them (N, count, 3)."""
    values = np.array(rows, dtype=np.float64)
    return values.reshape(0, *([count] if axes == 2 else []), 3) if not len(rows) else values


def _refuse_misspelt(path: Path, name: str, entry: object) -> None:
    """Refuse a key that is nearly one that counts: taken as a comment, its value would be lost.

    A text is a comment.
    """
    if not isinstance(entry, dict):
        return
    meant = [each for each in _COUNT if each not in entry]
    for key, value in entry.items():
        if key in (*_COUNT, *_COMMENTS) or isinstance(value, str):
            continue
        if hint := did_you_mean(key, meant):
            raise InputError(f"{path}: {name!r} has {key!r}{hint}", "SCHEMA_BROKEN")


def _number(path: Path, name: str, entry: object, key: str, default: float) -> float:
    value = entry.get(key, default) if isinstance(entry, dict) else entry
    if (
        not isinstance(entry, dict)
        or not isinstance(value, (int, float))
        or isinstance(value, bool)
        or value != value
    ):
        raise InputError(
            f'{path}: {name!r} is {entry!r}; expected {{"gain": 0.5 to 2, "offset": 0 to 0.2}}',
            "SCHEMA_BROKEN",
        )
    return float(value)


def calibration_json(calibration: Calibration, deviations: FloatArray, peaks: FloatArray) -> str:
    """Return a calibration as `read_calibration_file` reads it.

    `deviations` (K,) say how far each gain may be off, `peaks` (K,) how far the performer went.
    """
    rows = zip(
        calibration.shapes,
        calibration.gains,
        deviations,
        calibration.offsets,
        peaks,
        strict=True,
    )
    shapes = {
        name: {
            "gain": round(float(gain), _DIGITS),
            "deviation": round(float(deviation), _DIGITS),
            "offset": round(float(offset), _DIGITS),
            "peak": round(float(peak), _DIGITS),
        }
        for name, gain, deviation, offset, peak in rows
    }
    face = {} if calibration.face is None else {"face": _face_document(calibration.face)}
    signed = sign({"shapes": shapes, **face})
    text = json.dumps({"shapes": shapes}, indent=1, ensure_ascii=False)[:-2]
    for key in (*face, FINGERPRINT):  # each in a line of its own: they are no table to be edited
        text += f',\n "{key}": {json.dumps(signed[key])}'
    return text + "\n}\n"


def _face_document(face: PerformerFace) -> dict[str, object]:
    def plain(values: FloatArray) -> object:
        return values.round(_PLACES).tolist()

    rows = zip(face.markers, face.vertices.tolist(), face.shifts, face.rest, strict=True)
    return {
        "frames": face.frames,
        "markers": {
            name: {"point": point, "shift": plain(shift), "rest": plain(rest)}
            for name, point, shift, rest in rows
        },
        "displacements": {
            name: plain(moved) for name, moved in zip(face.shapes, face.displacements, strict=True)
        },
    }
