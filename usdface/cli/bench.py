"""The command `bench`: the published tables of the two methods, computed again."""

import argparse
from pathlib import Path
from typing import Any

from usdface.cli.command import DONE, FAILED, add_command, reported
from usdface.errors import InputError

__all__ = ["add_bench"]


def add_bench(commands: Any, summary: str) -> None:
    """Add `usdface bench`."""
    command = add_command(commands, "bench", _bench, summary)
    command.add_argument("name", choices=("papers", "solve"), metavar="papers")
    # Of `solve`, which is a script of the repository now.
    command.add_argument("--data", type=Path, help=argparse.SUPPRESS)
    command.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)


def _bench(parsed: argparse.Namespace) -> int:
    from usdface.cli.report import print_json, print_written

    if parsed.name == "solve":
        raise InputError(
            "the benchmark of the solve is not part of the package: clone the repository and run "
            "`python -m benchmarks.solve` there"
        )
    from usdface.papers import tables

    computed = tables()
    if not print_json([table.as_dict() for table in computed], parsed.format, parsed.report):
        from usdface.cli.print_papers import print_papers

        print_papers(computed)
        print_written(reported(parsed))
    return DONE if all(table.within for table in computed) else FAILED
