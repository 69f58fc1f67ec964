"""The calibration file, JSON: the gain of each movement of a performer.

::

    {"shapes": {"jawOpen": {"gain": 1.12, "deviation": 0.03, "offset": 0.0},
                "mouthSmile_L": {"gain": 0.84}}}

Only `gain` counts, and `offset` if there is one; other keys of a blend shape are comments.
"""

import json
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.takes.text_table import read_text
from usdface.retarget_setup import Calibration

__all__ = ["calibration_json", "read_calibration_file"]

_LARGEST = 16_000_000  # bytes
_DIGITS = 4  # of an amplitude; a hundredth of its usual deviation (AMPLITUDE_SPREAD)


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
        document = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no JSON that can be read: {error}", "FILE_UNREADABLE"
        ) from error
    shapes = document.get("shapes") if isinstance(document, dict) else None
    if not isinstance(shapes, dict):
        raise InputError(
            f'{path}: expected {{"shapes": {{"jawOpen": {{"gain": 1.1}}, ...}}}}', "SCHEMA_BROKEN"
        )
    gains = [_number(path, name, entry, "gain", 1.0) for name, entry in shapes.items()]
    offsets = [_number(path, name, entry, "offset", 0.0) for name, entry in shapes.items()]
    try:
        return Calibration(tuple(shapes), np.array(gains), np.array(offsets))
    except InputError as error:
        raise InputError(f"{path}: {error}", error.code) from error


def _number(path: Path, name: str, entry: object, key: str, default: float) -> float:
    value = entry.get(key, default) if isinstance(entry, dict) else entry
    if not isinstance(entry, dict) or not isinstance(value, (int, float)) or value != value:
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
        calibration.amplitudes,
        deviations,
        calibration.offsets,
        peaks,
        strict=True,
    )
    document = {
        "shapes": {
            name: {
                "gain": round(float(gain), _DIGITS),
                "deviation": round(float(deviation), _DIGITS),
                "offset": round(float(offset), _DIGITS),
                "peak": round(float(peak), _DIGITS),
            }
            for name, gain, deviation, offset, peak in rows
        }
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
