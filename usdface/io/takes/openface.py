"""The 68 landmarks of OpenFace as CSV.

Columns, with blanks after the commas: ``frame``, perhaps ``face_id``, ``timestamp``,
``confidence``, ``success``, then gaze, pose, ``x_0`` ... ``y_67`` [px] and more. The centre of the
top left pixel is (0, 0). The landmarks in space (``X_0`` ...) are those of OpenFace's own face
model, and are not read. Directions of the eyes and rotation of the head are those of a camera with
x right, y down and z ahead: R = Rx Ry Rz [rad], by which the landmarks in space turn, too. Of the
action units only 45 is, the blink, in ``AU45_r`` from 0 to 5; where its other detector, ``AU45_c``,
says 0 it counts little (they are trained apart, and differ).
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.several_faces import rows_of_face
from usdface.io.takes.text_table import read_table
from usdface.io.takes.wide_tracks import samples_of_columns
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_openface"]

_ROW = ("confidence", "success")
_BLINK, _PRESENT, _INTENSITIES = "AU45_r", "AU45_c", 5.0
_DENIED = 0.4  # at most, of an intensity that the other detector denies: a pulse needs 0.5
_GAZE = tuple(f"gaze_{eye}_{axis}" for eye in (0, 1) for axis in "xyz")
_POSE = ("pose_Rx", "pose_Ry", "pose_Rz")
_OPTIONAL = ("timestamp", _BLINK, _PRESENT, *_GAZE, *_POSE)


def read_openface(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the landmarks in the image of one face; of several that of most frames.

    OpenFace gives a face that it lost and found again another number; such faces are one where
    their places and sizes say so.

    A frame without success is occluded, as is one with less confidence than the options ask.

    Raises
    ------
    InputError
        If the file is missing, no such table, or has no landmarks in the image.
    """
    (_, header), *rows = read_table(path)
    columns = {name: column for column, name in reversed(list(enumerate(header)))}
    numbers = [n for n in range(len(header)) if f"x_{n}" in columns and f"y_{n}" in columns]
    missing = [name for name in ("frame", *_ROW) if name not in columns]
    if missing or not numbers:
        raise InputError(
            f"{path}: there is no column {(missing or ['x_0'])[0]}; "
            "export the 2D landmarks of OpenFace (-2Dfp)",
            "COLUMNS_WRONG",
        )
    blinks = _BLINK in columns
    gazes = all(name in columns for name in (*_GAZE, *_POSE))
    face, good = columns.get("face_id"), slice(columns["success"], columns["success"] + 1)
    rows, left_out = rows_of_face(
        path,
        rows,
        face,
        columns["frame"],
        lambda cells: "".join(cells[good]).startswith("1"),
        lambda cells: _points(cells, [columns[f"{axis}_{n}"] for n in numbers for axis in "xy"]),
    )
    shared = [name for name in (*_ROW, *_OPTIONAL) if name in columns]
    points = [(f"landmark_{n}", [columns[f"x_{n}"], columns[f"y_{n}"]]) for n in numbers]
    table = samples_of_columns(
        path, rows, columns["frame"], points, [columns[name] for name in shared]
    )
    values = dict(zip(shared, table.numbers[:, 3:].T, strict=True))
    success = values["success"] == 1
    sure = np.where(success, values["confidence"], -1.0)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:3] + 0.5,
        origin="top",
        first_frame=1,
        image_size=image_size(path, options),
        seconds=values.get("timestamp"),
        confidence=sure,
        blink=_blink(values, success) if blinks else None,
        gaze=_gaze(values, success) if gazes else None,
        ignored=_ignored(blinks, gazes),
    )
    take, findings = finish_tracks(tracks, options)
    return take, left_out + findings


def _ignored(blinks: bool, gazes: bool) -> list[str]:
    """Return the columns that are not read, of a table with blinks and gazes or without."""
    return [
        *([] if gazes else ["gaze"]),
        "position of the head" if gazes else "pose",
        "landmarks in space",
        "other action units" if blinks else "action units",
    ]


def _points(cells: list[str], columns: list[int]) -> FloatArray:
    """Return the landmarks (N, 2) [px] of a row, NaN where a cell has no number."""
    try:
        return np.array([float(cells[column]) for column in columns]).reshape(-1, 2)
    except (ValueError, IndexError):
        return np.full((len(columns) // 2, 2), np.nan)


def _gaze(values: Mapping[str, FloatArray], success: BoolArray) -> FloatArray:
    """Return yaw and pitch of both eyes in their head (N, 2) [rad], NaN without success."""
    from scipy.spatial.transform import Rotation  # costs more to import than most takes need

    numbers = np.stack([values[name] for name in (*_GAZE, *_POSE)], axis=1)
    seen = success & np.isfinite(numbers).all(axis=1)
    eyes = numbers[:, :6].reshape(-1, 2, 3).sum(axis=1)
    angles = np.full((len(success), 2), np.nan)
    turns = Rotation.from_euler("XYZ", numbers[seen, 6:])
    x, y, z = turns.inv().apply(eyes[seen]).T
    angles[seen] = np.stack([np.arctan2(x, -z), np.arctan2(-y, np.hypot(x, z))], axis=1)
    return angles


def _blink(values: Mapping[str, FloatArray], success: BoolArray) -> FloatArray:
    """Return the measure of a blink in each sample, NaN without success."""
    intensity = values[_BLINK]
    if _PRESENT in values:
        intensity = np.where(values[_PRESENT] == 0.0, intensity.clip(max=_DENIED), intensity)
    return np.where(success, intensity / _INTENSITIES, np.nan).clip(0.0, 1.0)
