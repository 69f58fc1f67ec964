"""Reports of commands: a table on the screen, or JSON."""

import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from usdface.face.place import Place
from usdface.findings import Finding
from usdface.io.atomic import write_text
from usdface.plain_text import listed, plain
from usdface.result import Result
from usdface.verdict import Level, Verdict

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["print_result", "print_whole", "shown", "write_report"]

_STYLES = {"info": "dim", "warning": "yellow", "error": "red"}
_WORDS: dict[Level, str] = {"good": "good", "look_at": "look at", "not_usable": "not usable"}
_LEVELS: dict[Level, str] = {"good": "green", "look_at": "yellow", "not_usable": "red"}
_EXAMPLES = 4  # findings of one kind that a line names: they fit a terminal of 100 columns
_ERRORS = ("error", "rounding")  # keys of values: the larger the worse
_LONGEST = 5000  # characters of one cell or line
_ANY_WIDTH = 1000  # characters
_PLACE = {field.name for field in fields(Place)}
_RANGES = {"neutral_frames"}  # keys whose list is a first and a last frame
_UNITS = {"degrees": "degrees", "mm": "mm", "s": "s", "hz": "Hz", "percent": "%", "mb": "MB"}


def print_result(result: Result[Any], form: str, file: TextIO | None = None) -> None:
    """Print a result as a table, or as JSON, to a stream (standard output)."""
    if form == "json":
        print(json.dumps(result.as_dict(), indent=1, ensure_ascii=False), file=file)
        return
    from rich.console import Console
    from rich.table import Table

    console = Console(file=file, soft_wrap=True, highlight=False)
    if result.summary:
        table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
        for key, value in result.summary.items():
            ranged = key in _RANGES and isinstance(value, list)
            text = " to ".join(map(str, value)) if ranged else _text(value)
            table.add_row(shown(_label(key)), shown(text))
        if console.is_terminal:
            console.print(table)
        else:  # a log, or grep: a figure stays in its line
            print_whole(console, table)
    for line, severity in _lines(result.findings):
        console.print(shown(line), style=_STYLES[severity])
    for path in result.written:
        console.print(f"wrote {shown(str(path))}", style="bold")
    if result.verdict:
        for line, style in _verdict_lines(result.verdict):
            console.print(shown(line), style=style)


def shown(text: str) -> str:
    """Return text for a console: no markup, no control characters."""
    from rich.markup import escape

    return escape(plain(text, _LONGEST, keep="\n"))


def _verdict_lines(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield the verdict, and for each reason a line that says it and one with its remedy."""
    yield f"verdict: {_WORDS[verdict.level]}", f"bold {_LEVELS[verdict.level]}"
    for reason in verdict.reasons:
        yield f"  {reason.criterion.code}: {reason.message}", _LEVELS[reason.level]
        yield f"    {reason.criterion.remedy}", ""


def _label(key: str) -> str:
    """Return the label of a stable key: ``residual_mean_mm`` is "residual mean [mm]"."""
    *words, last = key.split("_")
    unit = _UNITS.get(last)
    return " ".join(words) + f" [{unit}]" if words and unit else " ".join((*words, last))


def _text(value: Any) -> str:
    """Return a value of a summary as text: names with their numbers in one line, records below."""
    if isinstance(value, Mapping) and value.keys() == _PLACE:
        return str(Place(**value))
    if isinstance(value, Mapping):
        parts = [f"{_name(name, part)} {_fields(part)}" for name, part in value.items()]
        return _between(value.values()).join(parts) or "none"
    if isinstance(value, list | tuple):
        return _between(value).join(map(_text, value)) or "none"
    if value is None:
        return "not determined"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _name(name: str, value: Any) -> str:
    """Return a name as it stands before its value: a colon before a record, levels in words."""
    if isinstance(value, Mapping):
        return f"{name}:"
    return next((words for level, words in _WORDS.items() if level == name), name)


def _between(values: Iterable[Any]) -> str:
    """Return the separator of parts of a summary: a new line where they are records."""
    return "\n" if any(isinstance(value, Mapping) for value in values) else ", "


def _fields(value: Any) -> str:
    """Return the value of a name as text; the keys of a record are ours, so they get labels."""
    if isinstance(value, Mapping):
        return ", ".join(
            _text(part) if key == "place" else f"{_label(key)} {_text(part)}"
            for key, part in value.items()
        )
    return _text(value)


def _lines(findings: tuple[Finding, ...]) -> Iterator[tuple[str, str]]:
    """Yield one line for each code, and for each distinct message of it."""
    groups: dict[str, list[Finding]] = defaultdict(list)
    for finding in findings:
        groups[finding.code].append(finding)
    for group in groups.values():
        kinds: dict[str, list[Finding]] = {}
        messages: Counter[tuple[str, str]] = Counter()
        for finding in dict.fromkeys(group):
            # Infos are grouped by place, and by subject where they list it; a second
            # one about a place has a line of its own: among "others" it would not be printed.
            wording = _wording(finding)
            if finding.severity == "info":
                about = finding.message.partition(": ")[0] if "channels" in finding.values else ""
                messages[finding.where, about] += 1
                wording = f"{messages[finding.where, about]} {about}"
            if wording not in kinds and len(kinds) == _EXAMPLES:
                wording = next(iter(kinds))
            kinds.setdefault(wording, []).append(finding)
        for alike in kinds.values():
            alike.sort(key=_error, reverse=True)
            yield _line(alike), alike[0].severity


def _error(finding: Finding) -> float:
    """Return the error that a finding states; 0 if none. The largest one speaks for a group."""
    values = (value for key, value in finding.values.items() if key.startswith(_ERRORS))
    return max((float(v) for v in values if isinstance(v, int | float)), default=0.0)


def _wording(finding: Finding) -> str:
    """Return a message without places, quotes and numbers, to group findings."""
    place = re.escape(finding.where.split(": ")[-1])
    return re.sub(rf"(?<!\w)({place})(?!\w)|\"[^\"]*\"|'[^']*'|[-+\d.]+", "_", finding.message)


def _line(group: list[Finding]) -> str:
    first = group[0]
    line = f"{first.severity} {first.code}: {first.message}"
    if any(f.message != first.message for f in group):
        # The message is that of the first finding only.
        first_place, *others = _places(group)
        return f"{line} ({first_place}); others: {listed(others, _EXAMPLES)}"
    return line + (f" ({listed(_places(group), _EXAMPLES)})" if first.where else "")


def _places(group: list[Finding]) -> list[str]:
    """Return where findings are; the file that all are in only of the first."""
    first, *others = (f.where for f in group)
    file, colon, _ = first.rpartition(": ")
    shared = f"{file}{colon}"
    if all(place.startswith(shared) for place in others):
        others = [place.removeprefix(shared) for place in others]
    return [first, *others]


def write_report(result: Result[Any], path: Path) -> None:
    """Write a result as JSON, atomically.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_text(path, json.dumps(result.as_dict(), indent=1, ensure_ascii=False) + "\n")


def print_whole(console: "Console", table: "Table") -> None:
    """Print a table without cutting its cells, also in a pipe."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=_ANY_WIDTH)
    console.width = max(console.width, Measurement.get(console, unbounded, table).maximum)
    console.print(table)
