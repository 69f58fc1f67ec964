"""Labels as a table (CSV) or a list (JSON), by people or by an annotation program.

::

    take,start_s,end_s,emotion,variant,intensity
    angry.trc,1.2,2.5,anger,open_mouth,1
    angry.trc,0,0.8,neutral,,

The columns `start_s` and `end_s` are seconds, `start_frame` and `end_frame` frame indices of the
take from 0; both ends count. `variant` and `intensity` may be missing or empty. The emotion is
any word; `neutral` is the face at rest, `none` is movement without emotion, as speech. Takes lie
in the folder of the labels or below it. Semicolons and tabs part columns, too. JSON is a list of
objects with the same keys.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from usdface.errors import InputError
from usdface.io.json_values import checked_object
from usdface.io.takes.text_table import read_rows, read_text
from usdface.rule_learning.labels import NEUTRAL, NOTHING, Label

__all__ = ["read_labels"]

_LARGEST = 16_000_000  # bytes
_NEEDED = ("take", "emotion")
_KNOWN = ("take", "start_s", "end_s", "start_frame", "end_frame", "emotion", "variant", "intensity")


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read labelled stretches of takes.

    Raises
    ------
    InputError
        If the file is missing, is neither CSV nor JSON of the form above, or names a take
        outside its folder; the message names the line or entry.
    """
    if path.is_file() and path.stat().st_size > _LARGEST:
        raise InputError(f"{path} is larger than any table of labels; expected a small file")
    text = read_text(path)
    entries = _of_json(path, text) if path.suffix.lower() == ".json" else _of_csv(path, text)
    if not entries:
        raise InputError(f"{path} has no labels; expected one line for each stretch of a take")
    return tuple(_label(path, where, entry) for where, entry in entries)


def _of_csv(path: Path, text: str) -> list[tuple[str, Mapping[str, Any]]]:
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    rows = read_rows(path, text, delimiter)
    (_, header), body = rows[0], rows[1:]
    columns = [name.lower() for name in header]
    _check_keys(f"{path}, line 1", columns)
    for line, cells in body:
        if len(cells) > len(columns):
            raise InputError(f"{path}, line {line}: {len(cells)} cells for {len(columns)} columns")
    return [
        (f"{path}, line {line}", {n: c for n, c in zip(columns, cells, strict=False) if c})
        for line, cells in body
    ]


def _of_json(path: Path, text: str) -> list[tuple[str, Mapping[str, Any]]]:
    try:
        document = json.loads(text, object_pairs_hook=checked_object)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is no JSON that can be read: {error}") from error
    if not isinstance(document, list) or not all(isinstance(e, dict) for e in document):
        raise InputError(f"{path}: expected a list of objects, one for each stretch of a take")
    entries = [(f"{path}, entry {i}", entry) for i, entry in enumerate(document)]
    for where, entry in entries:
        _check_keys(where, list(entry))
    return [
        (where, {k: v for k, v in entry.items() if v not in ("", None)}) for where, entry in entries
    ]


def _check_keys(where: str, keys: list[str]) -> None:
    unknown = [key for key in keys if key not in _KNOWN]
    if unknown:
        raise InputError(f"{where}: unknown column {unknown[0]!r}; known: {', '.join(_KNOWN)}")
    if len(set(keys)) != len(keys):
        raise InputError(f"{where}: a column occurs twice")
    missing = [key for key in _NEEDED if key not in keys]
    if missing:
        raise InputError(f"{where}: no column {missing[0]!r}; known: {', '.join(_KNOWN)}")
    if {"start_s", "start_frame"} <= set(keys) or not {"start_s", "start_frame"} & set(keys):
        raise InputError(
            f"{where}: expected either start_s and end_s, or start_frame and end_frame"
        )


def _label(path: Path, where: str, entry: Mapping[str, Any]) -> Label:
    unit: Literal["frame", "s"] = "s" if "start_s" in entry else "frame"
    for key in (*_NEEDED, f"start_{unit}", f"end_{unit}"):
        if key not in entry:
            raise InputError(f"{where}: no {key}")
    start, end = (_number(where, entry, f"{edge}_{unit}") for edge in ("start", "end"))
    if unit == "frame" and not (start.is_integer() and end.is_integer()):
        raise InputError(f"{where}: frame indices are whole numbers; found {start:g} to {end:g}")
    take = _take(path, where, entry["take"])
    emotion = str(entry["emotion"])
    if emotion.lower() in (NEUTRAL, NOTHING):  # annotation programs write Neutral, None
        emotion = emotion.lower()
    intensity = _number(where, entry, "intensity") if "intensity" in entry else 1.0
    try:
        return Label(
            take,
            start,
            end,
            unit,
            emotion,
            str(entry.get("variant", "")),
            intensity,
        )
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _number(where: str, entry: Mapping[str, Any], key: str) -> float:
    try:
        return float(entry[key])
    except (TypeError, ValueError) as error:
        message = f"{where}: {key} is {entry[key]!r}; expected a number, decimals with a point"
        raise InputError(message) from error


def _take(path: Path, where: str, name: object) -> Path:
    """Return the place of a take, which must not lie outside the folder of the labels."""
    folder = path.resolve().parent
    place = (folder / str(name)).resolve()
    if "\0" in str(name) or not place.is_relative_to(folder):
        raise InputError(f"{where}: the take {name!r} lies outside the folder of the labels")
    return path.parent / str(name)
