"""Progress while a command works."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from usdface.result import OnStep

__all__ = ["progress"]


def _waiting(name: str) -> None:
    from usdface.result import COMPILE

    if name == COMPILE:
        print(f"usdface: {name} ...", file=sys.stderr)


@contextmanager
def progress(shown: bool) -> "Iterator[OnStep]":
    """Show the running step on a terminal, on standard error; yield what announces steps.

    Elsewhere only the step that keeps a first command waiting is named.
    """
    if not shown or not sys.stderr.isatty():
        yield _waiting
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)
        yield lambda name: bars.update(task, description=name)
