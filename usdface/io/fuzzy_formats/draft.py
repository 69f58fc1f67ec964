"""The text of a fuzzy system's file, and its content before it is a system."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Variable

__all__ = ["Draft", "read_text", "set_once"]

# Larger ones were not written by people or for them.
_MOST_BYTES = 4 << 20


@dataclass(frozen=True, slots=True)
class Draft:
    """The fuzzy system in the lines of a file, before the notes.

    `settings` are fields of `FuzzySystem`.
    """

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    settings: dict[str, Any]
    notes: tuple[tuple[int, str], ...] = ()
    findings: tuple[Finding, ...] = field(default=())


def set_once(settings: dict[str, Any], name: str, value: object) -> None:
    """Set a field of a `Draft`'s settings, which all blocks of a file must give alike.

    Raises
    ------
    InputError
        If it has another value already.
    """
    if settings.setdefault(name, value) != value:
        raise InputError(
            f"{name.strip('_')} is {value} here and {settings[name]} before; a system "
            "has one; split the file into one for each"
        )


def read_text(path: Path) -> str:
    """Read a file that people write.

    Raises
    ------
    InputError
        If it cannot be read, is empty, too large or not text.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path} has more than {_MOST_BYTES >> 20} MB: no fuzzy system")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror or error}", "FILE_UNREADABLE"
        ) from error
    if b"\0" in data or not data.strip():
        raise InputError(f"{path} is {'empty' if not data.strip() else 'not text'}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
