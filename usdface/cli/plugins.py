"""The command `plugins`: installed plug-ins of other packages."""

import argparse
from dataclasses import replace
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, report
from usdface.result import Result

__all__ = ["add_plugins"]


def add_plugins(commands: Any, summary: str) -> None:
    """Add `usdface plugins`."""
    add_command(commands, "plugins", _list, summary)


def _list(parsed: argparse.Namespace) -> int:
    result = pipeline.list_plugins()
    if parsed.format == "text":
        _print(result)
        result = replace(result, summary={})
    return report(parsed, result)


def _print(result: Result[None]) -> None:
    from rich.console import Console
    from rich.table import Table

    from usdface.cli.report import print_whole, shown

    plugins = result.details["plugins"]
    if not plugins:
        print("no package adds anything to usdface here")
        return
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for each in plugins:
        loads = "loads" if each["loads"] else "does not load"
        table.add_row(
            *(shown(part) for part in (each["kind"], each["name"], loads, each["origin"]))
        )
    print_whole(Console(soft_wrap=True, highlight=False), table)
