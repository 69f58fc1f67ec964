"""The command `bench`: published tables, and the solve beside others."""

import argparse
from pathlib import Path
from typing import Any

from usdface.cli.command import DONE, FAILED, add_command, reported

__all__ = ["add_bench"]


def add_bench(commands: Any) -> None:
    """Add `usdface bench`."""
    summary = "re-compute a published table, or measure the solve on takes of known weights"
    command = add_command(commands, "bench", _bench, summary)
    command.add_argument("name", choices=("papers", "solve"))
    command.add_argument("--data", type=Path, metavar="DIR", help="of solve: real data")
    command.add_argument("--quick", action="store_true", help="of solve: short takes")


def _bench(parsed: argparse.Namespace) -> int:
    from usdface.cli.report import print_json, print_written

    if parsed.name == "solve":
        from usdface.bench import DATA, solve_table
        from usdface.io.inputs import check_outputs, files_read

        if parsed.report:
            check_outputs([parsed.report], files_read(parsed.data or DATA))
        measured = solve_table(parsed.data, parsed.quick)
        if not print_json(measured, parsed.format, parsed.report):
            from usdface.cli.bench_tables import print_solve_table

            print_solve_table(measured)
            print_written(reported(parsed))
        return DONE
    from usdface.papers import tables

    computed = tables()
    if not print_json([table.as_dict() for table in computed], parsed.format, parsed.report):
        from usdface.cli.bench_tables import print_tables

        print_tables(computed)
        print_written(reported(parsed))
    return DONE if all(table.within for table in computed) else FAILED
