"""Files of the user beside a film: names of dots, and corrections."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.footage.fixes import Fix
from usdface.footage.labels import DotName
from usdface.io.asset_folder import read_file
from usdface.io.takes.text_table import read_table

__all__ = ["read_confidence", "read_fixes", "read_named_places"]

_MOST_BYTES = 2**24
_YES = ("true", "1", "yes")  # spreadsheets write TRUE


def read_named_places(path: Path) -> tuple[DotName, ...]:
    """Read names of dots: a table with columns name, x, y and perhaps frame, or JSON rows of these.

    Places are pixels from the image's top left corner, x right, y down; frame is the index of the
    frame from 0 (default 0).

    Raises
    ------
    InputError
        If the file is no such table.
    """
    rows = _rows(path)
    return tuple(
        DotName(_name(path, row), *_place(path, row), frame=_frame(path, row)) for row in rows
    )


def read_fixes(path: Path) -> tuple[Fix, ...]:
    """Read corrections: rows of frame, name and x, y (or ``"hidden": true``), CSV or JSON.

    Raises
    ------
    InputError
        If the file is no such table.
    """
    found = []
    for row in _rows(path):
        hidden = str(row.get("hidden")).lower() in _YES
        place = None if hidden else _place(path, row)
        found.append(Fix(_frame(path, row, needed=True), _name(path, row), place))
    return tuple(found)


def read_confidence(path: Path, count: int) -> dict[str, list[float]]:
    """Read the confidence of each dot in `count` frames from the report of a take.

    Raises
    ------
    InputError
        If the file is no such report, or of another number of frames.
    """
    try:
        data = json.loads(read_file(path, _MOST_BYTES * 16))
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no JSON: {error}; expected the report of a take of images (take --report)",
            "SCHEMA_BROKEN",
        ) from error
    details = data.get("details", data) if isinstance(data, dict) else None
    dots = details.get("dots") if isinstance(details, dict) else None
    if not isinstance(dots, dict):
        raise InputError(
            f"{path} has no dots; expected the report of a take of images (take --report)",
            "SCHEMA_BROKEN",
        )
    found = {}
    for name, each in dots.items():
        values = each.get("confidence") if isinstance(each, dict) else None
        if not (isinstance(values, list) and all(_is_share(value) for value in values)):
            raise InputError(
                f"{path}: the confidence of {name!r} is wrong; "
                "expected numbers from 0 to 1, one a frame",
                "SCHEMA_BROKEN",
            )
        if len(values) != count:
            raise InputError(
                f"{path} is of {len(values)} frames, the take has {count}; "
                "give the report of this take",
                "FRAMES_OUTSIDE",
            )
        found[name] = [float(value) for value in values]
    return found


def _is_share(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return 0.0 <= value <= 1.0


def _rows(path: Path) -> Sequence[dict[str, Any]]:
    if path.suffix.lower() == ".json":
        try:
            data = json.loads(read_file(path, _MOST_BYTES))
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{path} is no JSON: {error}; is it cut off, or in another format?", "SCHEMA_BROKEN"
            ) from error
        if isinstance(data, dict) and len(data) == 1:
            data = next(iter(data.values()))
        if not (isinstance(data, list) and all(isinstance(row, dict) for row in data)):
            raise InputError(
                f'{path}: expected a list of rows like {{"name": "chin", "x": 640, "y": 800}}',
                "SCHEMA_BROKEN",
            )
        return data
    if path.is_file() and path.stat().st_size > _MOST_BYTES:
        raise InputError(
            f"{path} is larger than any list of dots; expected at most a few thousand rows",
            "TOO_LARGE",
        )
    table = read_table(path)
    header = [cell.strip().lower() for cell in table[0][1]]
    return [dict(zip(header, cells, strict=False)) for _, cells in table[1:]]


def _name(path: Path, row: dict[str, Any]) -> str:
    name = row.get("name")
    if not (isinstance(name, str) and name.strip()):
        raise InputError(f"{path}: a row has no name; expected name, x, y", "COLUMNS_WRONG")
    return name.strip()


def _place(path: Path, row: dict[str, Any]) -> tuple[float, float]:
    return _number(path, row, "x"), _number(path, row, "y")


def _number(path: Path, row: dict[str, Any], key: str) -> float:
    value = row.get(key)
    try:
        number = float(value) if not isinstance(value, bool) else math.nan  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(
            f"{path}: {key} of {str(row.get('name'))!r} is {value!r}; expected a number",
            "VALUES_WRONG",
        )
    return number


def _frame(path: Path, row: dict[str, Any], needed: bool = False) -> int:
    if row.get("frame") in (None, "") and not needed:
        return 0
    number = _number(path, row, "frame")
    if number != int(number) or number < 0:
        raise InputError(
            f"{path}: frame {number:g}; expected a whole number from 0", "VALUES_WRONG"
        )
    return int(number)
