"""The YAML that calibration programs write, OpenCV's FileStorage among them.

Blocks by indentation, lists by ``-`` and ``[a, b]``, maps by ``{a: b}``; tags such as
``!!opencv-matrix`` are left out. No anchors, aliases, block texts or several documents, none of
which such a file has.
"""

import re
from pathlib import Path
from typing import Any, TypeAlias

from usdface.errors import InputError

__all__ = ["parse_block_yaml"]

Line: TypeAlias = tuple[int, int, str]  # number from 1, indentation, text

_DEEPEST = 16
# Without an overlap of its parts: a line is gone through once, however long it is.
_KEY = re.compile(r"""((?:"[^"]*"|'[^']*')\s*|[^\s"'\[\]{},:][^\[\]{},:"]*):(?:\s+|$)(.*)""")
_TAG = re.compile(r"!\S*\s*")
_TOKEN = re.compile(r"""[\[\]{},]|"[^"]*"|'[^']*'|[^\s\[\]{},"'][^\[\]{},]*""")


def parse_block_yaml(path: Path, text: str) -> Any:
    """Return the maps, lists, numbers and texts of a file.

    Raises
    ------
    InputError
        If it is written in any other way.
    """
    lines = _lines(path, text)
    if not lines:
        raise InputError(
            f"{path} is empty; expected the YAML of a camera calibration", "SCHEMA_BROKEN"
        )
    value, at = _block(path, lines, 0, 0)
    if at < len(lines):
        raise _wrong(path, lines[at])
    return value


def _lines(path: Path, text: str) -> list[Line]:
    """Return the lines with content; a list or map in brackets is on one."""
    lines: list[Line] = []
    opened = 0
    parts: list[str] = []
    for number, raw in enumerate(text.splitlines(), 1):
        written = re.sub(r"(^|\s)#.*", "", raw).rstrip()
        bare = written.strip()
        if not bare or bare in ("---", "...") or bare.startswith("%"):
            continue
        if opened:
            parts.append(bare)
        else:
            parts = [bare]
            lines.append((number, len(written) - len(written.lstrip()), bare))
        opened += sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}")
        if opened < 0:
            raise _wrong(path, lines[-1])
        if not opened and len(parts) > 1:
            lines[-1] = (*lines[-1][:2], " ".join(parts))
    if opened:
        raise InputError(
            f"{path}, line {lines[-1][0]}: a bracket does not close; export or copy it again",
            "FILE_CUT_OFF",
        )
    return lines


def _block(path: Path, lines: list[Line], at: int, depth: int) -> tuple[Any, int]:
    """Return the map or list whose first line is `at`, and the line after it."""
    if depth > _DEEPEST:
        raise InputError(
            f"{path}: more than {_DEEPEST} levels; "
            "expected the few of a calibration, written by its program",
            "SCHEMA_BROKEN",
        )
    indent = lines[at][1]
    if lines[at][2].startswith(("[", "{")):
        return _flow(path, lines[at], lines[at][2]), at + 1
    if _is_item(lines[at]):
        items = []
        while at < len(lines) and lines[at][1] == indent and _is_item(lines[at]):
            number, _, text = lines[at]
            rest = text[1:].lstrip()
            if _KEY.fullmatch(rest):  # a map begins behind the dash
                lines[at] = (number, indent + len(text) - len(rest), rest)
                value, at = _block(path, lines, at, depth + 1)
            else:
                value, at = _value(path, lines, at, rest, depth)
            items.append(value)
        return items, at
    found: dict[str, Any] = {}
    while at < len(lines) and lines[at][1] == indent:
        match = _KEY.fullmatch(lines[at][2])
        if not match or _is_item(lines[at]):
            raise _wrong(path, lines[at])
        key = match[1].strip().strip("\"'")
        if key in found:
            raise InputError(
                f"{path}, line {lines[at][0]}: {key[:40]!r} occurs twice; keep one of them",
                "SCHEMA_BROKEN",
            )
        found[key], at = _value(path, lines, at, match[2], depth)
    return found, at


def _value(path: Path, lines: list[Line], at: int, text: str, depth: int) -> tuple[Any, int]:
    """Return the value that `text` or the lines below it hold, and the line after it."""
    text = _TAG.sub("", text, count=1) if text.startswith("!") else text
    if text:
        return _flow(path, lines[at], text), at + 1
    _, indent, _ = lines[at]
    below = at + 1
    nested = below < len(lines) and (
        lines[below][1] > indent
        or (lines[below][1] == indent and _is_item(lines[below]) and not _is_item(lines[at]))
    )
    return _block(path, lines, below, depth + 1) if nested else (None, below)


def _flow(path: Path, line: Line, text: str) -> Any:
    """Return a number, a text, or a bracketed list or map."""
    if text[0] not in "[{":
        return _scalar(text)
    stack: list[list[Any]] = [[]]
    kinds: list[str] = []
    for token in _TOKEN.findall(text):
        if token in "[{":
            stack.append([])
            kinds.append(token)
            if len(stack) > _DEEPEST:
                raise InputError(
                    f"{path}: more than {_DEEPEST} levels; "
                    "expected the few of a calibration, written by its program",
                    "SCHEMA_BROKEN",
                )
        elif token in "]}":
            if not kinds or {"[": "]", "{": "}"}[kinds[-1]] != token:
                raise _wrong(path, line)
            items = stack.pop()
            stack[-1].append(items if kinds.pop() == "[" else _pairs(path, line, items))
        elif token != ",":
            stack[-1].append(_entry(token) if kinds and kinds[-1] == "{" else _scalar(token))
    if len(stack) > 1 or len(stack[0]) != 1:
        raise _wrong(path, line)
    return stack[0][0]


def _entry(token: str) -> tuple[str, Any]:
    key, _, value = token.partition(":")
    return key.strip().strip("\"'"), _scalar(value.strip()) if value.strip() else None


def _pairs(path: Path, line: Line, items: list[Any]) -> dict[str, Any]:
    """Return a map of entries; a list or map belongs to the entry before it."""
    found: dict[str, Any] = {}
    last = ""
    for item in items:
        if isinstance(item, tuple):
            last = item[0]
            found[last] = item[1]
        elif last and found[last] is None:
            found[last] = item
        else:
            raise _wrong(path, line)
    return found


def _scalar(text: str) -> Any:
    text = text.strip()
    if text[:1] in ("'", '"'):
        return text.strip(text[0])
    try:
        return float(text.replace(".Nan", "nan").replace(".Inf", "inf"))
    except ValueError:
        return text


def _is_item(line: Line) -> bool:
    return line[2] == "-" or line[2].startswith("- ")


def _wrong(path: Path, line: Line) -> InputError:
    return InputError(
        f"{path}, line {line[0]}: {line[2][:40]!r}; expected lines of YAML like key: value, - item",
        "SCHEMA_BROKEN",
    )
