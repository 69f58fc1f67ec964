"""Progress while a command works."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from usdface.progress import OnProgress, Step

__all__ = ["progress"]


def _announce_compilation(step: "Step") -> None:
    from usdface.progress import COMPILE

    if step.name == COMPILE:
        print(f"usdface: {step.name} ...", file=sys.stderr)


@contextmanager
def progress(shown: bool) -> "Iterator[OnProgress]":
    """Show the running step on a terminal, on standard error; yield the callback for it.

    Elsewhere only the compilation of the solver is named, which delays the first command.
    """
    if not shown or not sys.stderr.isatty():
        yield _announce_compilation
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)

        def show(step: "Step") -> None:
            total = None if step.fraction is None else 1.0
            bars.update(task, description=step.name, total=total, completed=step.fraction or 0.0)

        yield show
