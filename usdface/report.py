"""Reports: progress while a command works, a table when it is done, JSON for farms."""

import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from usdface.findings import Finding
from usdface.io.atomic import write_text
from usdface.outcome import OnStep, Outcome

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from usdface.fitting import Fitted
    from usdface.papers import PaperTable
    from usdface.resting import RestingAnswer

__all__ = [
    "print_explanation",
    "print_fit",
    "print_outcome",
    "print_resting",
    "print_tables",
    "progress",
    "write_report",
]

_STYLES = {"info": "dim", "warning": "yellow", "error": "red"}
_EXAMPLES = 4
_ANY_WIDTH = 1000  # characters


@contextmanager
def progress(shown: bool) -> Iterator[OnStep | None]:
    """Show the running step on a terminal, on standard error; yield what announces steps."""
    if not shown or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)
        yield lambda name: bars.update(task, description=name)


def print_outcome(outcome: Outcome, form: str, file: TextIO | None = None) -> None:
    """Print an outcome as a table, or as JSON, to a stream (standard output)."""
    if form == "json":
        print(json.dumps(outcome.as_dict(), indent=1, ensure_ascii=False), file=file)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(file=file, soft_wrap=True, highlight=False)
    if outcome.summary:
        table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
        for name, value in outcome.summary.items():
            table.add_row(escape(name), escape(str(value)))
        console.print(table)
    for line, severity in _lines(outcome.findings):
        console.print(escape(line), style=_STYLES[severity])
    for path in outcome.written:
        console.print(f"wrote {escape(str(path))}", style="bold")


def _lines(findings: tuple[Finding, ...]) -> Iterator[tuple[str, str]]:
    """Yield one line for each code, however often it was found."""
    groups: dict[str, list[Finding]] = defaultdict(list)
    for finding in findings:
        groups[finding.code].append(finding)
    for code, group in groups.items():
        first = group[0]
        if len(group) == 1:
            where = f" ({first.where})" if first.where else ""
            yield f"{first.severity} {code}: {first.message}{where}", first.severity
            continue
        places = ", ".join(f.where for f in group[:_EXAMPLES])
        more = f" and {len(group) - _EXAMPLES} more" if len(group) > _EXAMPLES else ""
        yield f"{first.severity} {code}: {first.message} ({places}{more})", first.severity


def write_report(outcome: Outcome, path: Path) -> None:
    """Write an outcome as JSON, atomically.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_text(path, json.dumps(outcome.as_dict(), indent=1, ensure_ascii=False) + "\n")


def print_tables(tables: "list[PaperTable]", form: str, report: Path | None) -> None:
    """Print re-computed tables beside the published figures."""
    document = [table.as_dict() for table in tables]
    text = json.dumps(document, indent=1, ensure_ascii=False)
    if report:
        write_text(report, text + "\n")
    if form == "json":
        print(text)
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    for paper in tables:
        kept = "kept" if paper.within else "NOT KEPT"
        caption = (
            f"{paper.legible} published figures: RMS difference {paper.rms:.4f}, "
            f"largest {paper.largest:.4f}; promise: {paper.promise} ({kept})"
        )
        table = Table(title=f"{paper.title}: published | ours", caption=caption, box=SIMPLE)
        table.add_column("", no_wrap=True)
        for name in paper.columns:
            table.add_column(name, justify="right", no_wrap=True)
        for name, published, ours in zip(paper.rows, paper.published, paper.computed, strict=True):
            pairs = zip(published, ours, strict=True)
            table.add_row(name, *(f"{'?' if p != p else f'{p:.2f}'}|{o:.3f}" for p, o in pairs))
        _print_whole(console, table)


def _print_whole(console: "Console", table: "Table") -> None:
    """Print a table in lines as long as they need to be, also in a pipe: half a figure is none."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=_ANY_WIDTH)
    console.width = max(console.width, Measurement.get(console, unbounded, table).maximum)
    console.print(table)


def print_fit(fitted: "Fitted") -> None:
    """Print a fitted system: its rules, what it confuses, and which motions tell emotions apart."""
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False, soft_wrap=True)
    for rule in fitted.system.rules:
        console.print(escape(" ".join(rule.text.split())))
    tested = fitted.validation
    if tested is not None and tested.tested:
        title = f"shown (rows) and heard, each {tested.holding} held out"
        table = Table(title=title, title_justify="left", box=SIMPLE)
        labels = [*tested.names, "none"]
        for label in ("", *labels, "margin: mean", "worst"):
            table.add_column(escape(label), justify="right" if label else "left", no_wrap=True)
        for label, row in zip(labels, tested.counts, strict=True):
            margins = tested.margins_of("" if label == "none" else label)
            figures = [f"{margins.mean():+.2f}", f"{margins.min():+.2f}"] if margins.size else []
            table.add_row(escape(label), *(str(n) if n else "." for n in row), *figures)
        _print_whole(console, table)
    if fitted.separations:
        title = "the motions that separate two emotions best, and by how many spreads"
        table = Table(title=title, title_justify="left", box=SIMPLE)
        for column in ("emotions", "motions", "spreads", "mistaken"):
            table.add_column(column, no_wrap=True)
        for pair in sorted(fitted.separations, key=lambda pair: pair.sensitivity):
            mistaken = f"{pair.mistaken} of {pair.tested}" if pair.tested else "not tested"
            cells = " / ".join(pair.emotions), ", ".join(pair.features)
            table.add_row(*map(escape, cells), f"{pair.sensitivity:.1f}", mistaken)
        _print_whole(console, table)


def print_explanation(facts: dict[str, Any], form: str, report: Path | None) -> None:
    """Print why a frame gets its emotions (`usdface.explain.Explanation.frame`)."""
    text = json.dumps(facts, indent=1, ensure_ascii=False)
    if report:
        write_text(report, text + "\n")
    if form == "json":
        print(text)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False, soft_wrap=True)
    console.print(f"frame {facts['frame']}, {facts['seconds']:g} s", style="bold")
    emotions = (f"{name} {value:.2f}" for name, value in facts["emotions"].items())
    console.print(escape("  ".join(emotions)))
    fired = [rule for rule in facts["rules"] if rule["fires"] > 0]
    title = "rules that fire" if fired else "no rule fires; every emotion has its default"
    console.print(f"\n{title}", style="bold")
    asked = set()
    for rule in fired:
        console.print(escape(f"{rule['fires']:.2f}  {rule['rule']}"))
        for part in rule["conditions"]:
            asked.add(part["variable"])
            line = f"        {_distance(part)}  {part['variable']} is {part['is']}"
            console.print(escape(f"{line} {part['degree']:.2f}"))
    table = Table(title="\nother features", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for column in ("change", "feature", "terms"):
        table.add_column(column, justify="right" if column == "change" else "left")
    for feature in facts["features"]:
        terms = ", ".join(f"{name} {value:.2f}" for name, value in feature["terms"].items())
        if feature["name"] not in asked:
            table.add_row(_distance(feature), escape(feature["name"]), escape(terms))
    if table.row_count:
        console.print(table)
    if facts["weights"]:
        console.print("\nweights, solved and corrected", style="bold")
    for shape, weight in facts["weights"].items():
        line = f"{weight['solved']:.2f} -> {weight['corrected']:.2f}  {shape}"
        console.print(escape(line))


def _distance(fact: dict[str, Any]) -> str:
    """Return how far a marker has moved relative to the nose tip, in ten characters."""
    return f"{'occluded' if fact['mm'] is None else format(fact['mm'], '+.2f') + ' mm':>10}"


def print_resting(answers: "Sequence[RestingAnswer]", form: str, report: Path | None) -> None:
    """Print what systems answer to a neutral face, side by side."""
    text = json.dumps([answer.as_dict() for answer in answers], indent=1, ensure_ascii=False)
    if report:
        write_text(report, text + "\n")
    if form == "json":
        print(text)
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False, soft_wrap=True)
    columns: dict[str, dict[str, float]] = {}
    for answer in answers:
        columns[f"{answer.system}: neutral"] = answer.exact
        if answer.mean is not None and answer.largest is not None:
            columns["jitter, mean"], columns["largest"] = answer.mean, answer.largest
    table = Table(title="answers to a neutral face", title_justify="left", box=SIMPLE)
    for name in ("", *columns):
        table.add_column(escape(name), justify="right" if name else "left", no_wrap=True)
    for emotion in dict.fromkeys(e for column in columns.values() for e in column):
        cells = (f"{c[emotion]:.3f}" if emotion in c else "" for c in columns.values())
        table.add_row(escape(emotion), *cells)
    _print_whole(console, table)
    console.print(
        "jitter: 20 s of resting markers with 0.3 mm of noise, through the solve", style="dim"
    )
    for answer in answers:
        if answer.rules:
            console.print(escape(f"fires at neutral, {answer.system}:"), style="bold")
        for rule in answer.rules:
            console.print(escape(f"  {rule}"))
