"""Progress while a command works."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from usdface.progress import OnProgress, Step

__all__ = ["progress"]


@contextmanager
def progress(shown: bool) -> "Iterator[OnProgress | None]":
    """Show the running step on a terminal, on standard error; yield the callback for it."""
    if not shown or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)

        def announce(step: "Step") -> None:
            total = None if step.fraction is None else 1.0
            bars.update(task, description=step.name, total=total, completed=step.fraction or 0.0)

        yield announce
