"""Progress while a command works, on standard error: bars, lines of text, or lines of JSON."""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from usdface.signals import was_stopped

if TYPE_CHECKING:
    from usdface.progress import OnProgress, Step

__all__ = ["PROGRESS", "progress"]

PROGRESS = ("auto", "plain", "json", "openjd", "none")
# A step is printed again after this fraction of it.
_STEPS = 10


@contextmanager
def progress(parsed: argparse.Namespace) -> "Iterator[OnProgress]":
    """Show the running step on standard error; yield the callback for it.

    It also ends the command where a signal came whose exception was lost, as in the callbacks of
    libraries from C.
    """
    with _shown(parsed) as show:

        def shown(step: "Step") -> None:
            if was_stopped():
                raise KeyboardInterrupt
            show(step)

        yield shown


@contextmanager
def _shown(parsed: argparse.Namespace) -> "Iterator[OnProgress]":
    """Yield a callback that shows the running step.

    Of the forms of ``--progress``, "auto" is a bar on a terminal, unless the report is JSON.
    Elsewhere it only names the compilation of the solver, which delays the first command.
    """
    form = parsed.progress
    if form in _LINES:
        yield _lines(_LINES[form])
    elif form == "none":
        yield lambda _: None
    elif parsed.format == "text" and sys.stderr.isatty():
        with _bar() as show:
            yield show
    else:
        yield _announce_compilation


def _announce_compilation(step: "Step") -> None:
    from usdface.progress import COMPILE

    if step.name == COMPILE:
        _print(f"usdface: {step.name} ...")


def _print(text: str) -> None:
    """Print for whoever watches; where nobody does any more, the work goes on."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def _lines(line: "Callable[[Step, float], str]") -> "OnProgress":
    """Return a callback that prints a line for each step, and for each tenth of a long one."""
    begin, printed = time.perf_counter(), ("", -1)

    def show(step: "Step") -> None:
        nonlocal printed
        tenth = -1 if step.fraction is None else int(_STEPS * step.fraction)
        if printed != (step.name, tenth):
            printed = step.name, tenth
            _print(line(step, time.perf_counter() - begin))

    return show


def _as_text(step: "Step", _: float) -> str:
    done = "" if step.fraction is None else f" {step.fraction:.0%}"
    return f"usdface: {step.name}{done}"


def _as_json(step: "Step", seconds: float) -> str:
    fraction = None if step.fraction is None else round(step.fraction, 3)
    values = {"step": step.name, "fraction": fraction, "seconds": round(seconds, 3)}
    return json.dumps(values)


def _as_openjd(step: "Step", _: float) -> str:
    """Return the lines that a task of Open Job Description prints for its manager."""
    status = f"openjd_status: {step.name}"
    share = "" if step.fraction is None else f"\nopenjd_progress: {100 * step.fraction:.1f}"
    return status + share


_LINES = {"plain": _as_text, "json": _as_json, "openjd": _as_openjd}


@contextmanager
def _bar() -> "Iterator[OnProgress]":
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)

        def show(step: "Step") -> None:
            total = None if step.fraction is None else 1.0
            bars.update(task, description=step.name, total=total, completed=step.fraction or 0.0)

        yield show
