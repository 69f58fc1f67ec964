"""The record of a result: the key it was made with, its files, its row of the table.

It lies in the folder of the result's layers. It is not trusted: files are digested again, and a
record of another form is ignored.
"""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from usdface.errors import InputError, OutputError
from usdface.io.atomic import write_text
from usdface.io.layer_paths import layer_paths
from usdface.io.relative_path import relative_path
from usdface.show.keys import content_key, file_digest, numbered_siblings

__all__ = [
    "Record",
    "note_failure",
    "read_failure",
    "read_record",
    "record_of",
    "record_path",
    "write_record",
]

_LARGEST = 16_000_000  # bytes


@dataclass(frozen=True, slots=True)
class Record:
    """A result and all that it depends on.

    Attributes
    ----------
    key : str
    files : mapping of str to str
        Digest of each file that was read, by its name relative to the shot's folder.
    absent : list of str
        Files that are named by those, but were not there; likewise.
    siblings : mapping of str to list of str
        Files beside numbered ones.
    outputs : mapping of str to str
        Digest of each file that was written, likewise.
    row : mapping
        The row of the table; of a shot's making what `usdface.show.making_record` keeps.
    """

    key: str
    files: dict[str, str]
    absent: list[str]
    siblings: dict[str, list[str]]
    outputs: dict[str, str]
    row: dict[str, Any]

    def is_current(self, folder: Path, options: Any) -> bool:
        """Return whether the existing result is up to date with these options."""
        return self.intact(folder) and self.key == self.key_now(folder, options)

    def intact(self, folder: Path) -> bool:
        """Return whether the result exists as it was written."""
        return bool(self.outputs) and _same(self.outputs, folder)

    def wrote(self, path: Path, folder: Path) -> bool:
        """Return whether a file is an output, and as it was written."""
        digest = self.outputs.get(relative_path(path, folder))
        return bool(digest) and file_digest(path) == digest

    def key_now(self, folder: Path, options: Any) -> str:
        """Return the key of a run now; "" where a file is missing or a new one exists."""
        if not _same(self.files, folder) or any((folder / name).exists() for name in self.absent):
            return ""
        siblings = _siblings(self.files, folder)
        return content_key(self.files, self.absent, siblings, options)


def record_of(
    folder: Path,
    *,
    read: Iterable[Path],
    absent: Iterable[Path],
    options: Any,
    written: Iterable[Path] = (),
    row: Mapping[str, Any] | None = None,
) -> Record:
    """Return the record of a result whose shot is in a folder."""
    files = {relative_path(path, folder): file_digest(path) or "" for path in read}
    missing = sorted(relative_path(path, folder) for path in absent)
    siblings = _siblings(files, folder)
    key = content_key(files, missing, siblings, options)
    outputs = {relative_path(path, folder): file_digest(path) or "" for path in written}
    return Record(key, files, missing, siblings, outputs, dict(row or {}))


def record_path(shot: Path, name: str = "record") -> Path:
    """Return where the record of a shot's result lies."""
    return layer_paths(shot).folder / f"{name}.json"


def read_record(path: Path) -> Record | None:
    """Read a record; None where there is none, or none of this form."""
    try:
        if path.stat().st_size > _LARGEST:
            return None
        document = json.loads(path.read_text(encoding="utf-8", errors="surrogateescape"))
        values = [document[part.name] for part in fields(Record)]
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None
    kinds = (str, dict, list, dict, dict, dict)
    if not all(isinstance(value, kind) for value, kind in zip(values, kinds, strict=True)):
        return None
    record = Record(*values)
    named = (*record.files, *record.absent, *record.outputs)
    good = all(isinstance(name, str) and "\0" not in name for name in named)
    return record if good else None


def write_record(path: Path, record: Record) -> None:
    """Write a record, atomically."""
    write_text(path, json.dumps(asdict(record), indent=1) + "\n")


def note_failure(shot: Path, row: Mapping[str, Any] | None) -> None:
    """Keep the row of a failed shot, for a table that is gathered later; None = no failure."""
    place = record_path(shot, "failed")
    with suppress(OSError, OutputError):  # on a full disk, say
        if row is not None:
            write_text(place, json.dumps(row, indent=1) + "\n")
        else:
            place.unlink(missing_ok=True)


def read_failure(shot: Path) -> dict[str, Any] | None:
    """Return the row that `note_failure` kept; None where there is none."""
    try:
        place = record_path(shot, "failed")
        if place.stat().st_size > _LARGEST:
            return None
        row = json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, InputError):
        return None
    return row if isinstance(row, dict) else None


def _same(digests: Mapping[str, str], folder: Path) -> bool:
    return all(file_digest(folder / name) == digest for name, digest in digests.items())


def _siblings(files: Iterable[str], folder: Path) -> dict[str, list[str]]:
    found = numbered_siblings(folder / name for name in files)
    return {relative_path(Path(pattern), folder): names for pattern, names in found.items()}
