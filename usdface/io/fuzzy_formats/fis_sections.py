"""The sections of MATLAB's .fis, with the line of each of their keys."""

import re
from collections.abc import Callable
from typing import TypeVar

from usdface.errors import InputError

__all__ = ["Section", "check_announced", "located", "sections"]

_Made = TypeVar("_Made")
Section = dict[str, tuple[int, str]]


def sections(name: str, text: str) -> tuple[dict[str, Section], list[tuple[int, str]]]:
    """Return the lines of each section by key (rules by number), and the notes."""
    found: dict[str, Section] = {}
    notes = []
    current: Section | None = None
    terms = 0
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith(("%", "#")):
            comment = line.lstrip("%# ")
            if comment.startswith("usdface:"):
                notes.append((number, comment.removeprefix("usdface:")))
        elif match := re.fullmatch(r"\[(\w+)\]", line):
            if match[1] in found:
                raise InputError(f"{name}, line {number}: a second [{match[1]}]; merge them")
            current, terms = found.setdefault(match[1], {}), 0
        elif line and current is None:
            raise InputError(f"{name}, line {number}: expected [System], found {line[:40]!r}")
        elif line and current is not None:
            key, equals, value = line.partition("=")
            key = key.strip() if equals else f"rule {number}"
            if re.fullmatch(r"MF\d+", key):
                # MATLAB takes terms as they come, and ships files that count wrongly.
                terms += 1
                key = f"MF{terms}"
            if key in current:
                raise InputError(f"{name}, line {number}: a second {key}; remove one")
            current[key] = (number, value.strip() if equals else line)
    return found, notes


def located(name: str, line: int, make: Callable[[], _Made]) -> _Made:
    """Name file and line in an error of `make`."""
    try:
        return make()
    except InputError as error:
        raise InputError(f"{name}, line {line}: {error}") from error


def check_announced(name: str, section: Section, key: str, count: int) -> None:
    """Raise InputError where a section announces another number than there is."""
    line, text = section.get(key, (0, str(count)))
    if text != str(count):
        raise InputError(
            f"{name}, line {line}: {key} is {text}, but there are {count}; the file is cut off "
            "or was edited"
        )
