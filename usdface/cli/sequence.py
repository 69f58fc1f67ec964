"""The command `sequence`: many shots, in worker processes."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface import pipeline
from usdface.cli.command import EDITED_RESULT, add_command, add_overwrite, add_skip_hook, report
from usdface.cli.option_rules import check_together
from usdface.cli.progress import progress
from usdface.errors import InputError, UsdFaceError

if TYPE_CHECKING:
    from usdface.show.table import Row

__all__ = ["add_sequence"]

# Options by the one that they belong to, and by the one that ignores them.
_NEEDS = {"chunk": "--openjd DIR"}
_EXCLUDES = {
    "openjd": (
        *("index", "workers", "time_limit", "table", "watch", "cache", "no_cache"),
        *("gather", "overwrite"),
    ),
    "gather": ("watch", "cache", "no_cache", "workers", "time_limit", "overwrite"),
}


def add_sequence(commands: Any, summary: str) -> None:
    """Add `usdface sequence`."""
    command = add_command(commands, "sequence", _sequence, summary, writes=("table",))
    command.add_argument(
        "sources",
        nargs="+",
        metavar="SOURCE",
        help="show file (.toml, .json), folder, list of shots (.txt), or shots",
    )
    command.add_argument(
        "--root",
        default="",
        metavar="DIR",
        help="names in the sources are relative to it",
    )
    command.add_argument("--workers", type=int, help="processes (default: one for each core)")
    command.add_argument("--watch", action="store_true", help="process changed shots, until Ctrl-C")
    command.add_argument(
        "--pages", action="store_true", help="also write a page for each shot, as view does"
    )
    command.add_argument(
        "--table", default="", metavar="FILE.html", help="also write the table as a page"
    )
    add_overwrite(command, f"{EDITED_RESULT}; an edited shot of a show file is kept")
    add_skip_hook(command)
    _add_cache(command.add_argument_group("cache").add_mutually_exclusive_group())
    _add_farm(command.add_argument_group("farms"))


def _add_cache(group: Any) -> None:
    group.add_argument(
        "--cache",
        default="",
        metavar="DIR",
        help="folder for the arrays of each stage (default: beside each result)",
    )
    group.add_argument("--no-cache", action="store_true", help="keep no arrays")


def _add_farm(group: Any) -> None:
    group.add_argument(
        "--index",
        default="",
        metavar="N[-M]",
        help="only these shots, counted from 0 in the order of the sources",
    )
    group.add_argument(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        help="for a shot, after which it has failed (default: an hour)",
    )
    group.add_argument(
        "--keep-going",
        action="store_true",
        help="exit with 0 also where a shot failed: the last step of a farm's job reports it",
    )
    group.add_argument(
        "--gather", action="store_true", help="process nothing: print the table of existing results"
    )
    group.add_argument(
        "--openjd",
        default="",
        metavar="DIR",
        help="process nothing: write the sequence as a job of Open Job Description",
    )
    group.add_argument(
        "--chunk", type=int, metavar="N", help="shots in a task of that job (default: 1)"
    )


def _sequence(parsed: argparse.Namespace) -> int:
    limits = {"time_limit": parsed.time_limit} if parsed.time_limit is not None else {}
    for name, value in (("workers", parsed.workers), ("time-limit", parsed.time_limit)):
        if value is not None and not value > 0:
            raise InputError(f"--{name} {value:g}: expected more than 0", "SETTING_WRONG")
    check_together(parsed, _NEEDS, _EXCLUDES)
    if parsed.openjd:
        return _openjd(parsed)
    if parsed.watch:
        return _watch(parsed, limits)
    return _run(parsed, limits)


def _watch(parsed: argparse.Namespace, limits: dict[str, float]) -> int:
    """Run again after each change of a file of the sequence, until a signal ends it."""
    from usdface.pipeline.sequence import plans_of
    from usdface.show.watch import files_of, states_of, wait_for_change

    sources = [Path(source) for source in parsed.sources]

    def files() -> list[Path]:
        try:
            return files_of(sources, plans_of(sources, parsed.root))
        except UsdFaceError:  # a show file that is just being edited
            return sources

    while True:
        since = states_of(files())
        try:
            _run(parsed, limits)
        except UsdFaceError as error:
            print(f"usdface: {error} [{error.code}]", file=sys.stderr)
        print("usdface: watching; Ctrl-C ends it", file=sys.stderr)
        wait_for_change(files, since)


def _run(parsed: argparse.Namespace, limits: dict[str, float]) -> int:
    if parsed.report:
        from usdface.pipeline.sequence import check_unread, plans_of

        check_unread([parsed.report], parsed.sources, plans_of(parsed.sources, parsed.root))
    with progress(parsed) as step:
        result = pipeline.process_sequence(
            parsed.sources,
            index=parsed.index,
            workers=parsed.workers,
            pages=parsed.pages,
            table=parsed.table,
            root=parsed.root,
            gather=parsed.gather,
            cache=parsed.cache or not parsed.no_cache,
            overwrite=parsed.overwrite,
            skip_hooks=parsed.skip_hooks,
            on_progress=step,
            **limits,
        )
    if parsed.format == "text":
        _print_table(result.value)
    return report(parsed, result, fail_on=() if parsed.keep_going else ("error",))


def _openjd(parsed: argparse.Namespace) -> int:
    from usdface.pipeline.farm_jobs import write_sequence_job

    with progress(parsed) as step:
        result = write_sequence_job(
            parsed.sources,
            parsed.openjd,
            chunk=1 if parsed.chunk is None else parsed.chunk,
            pages=parsed.pages,
            skip_hooks=parsed.skip_hooks,
            root=parsed.root or None,
            on_progress=step,
        )
    return report(parsed, result)


def _print_table(rows: "Sequence[Row]") -> None:
    from rich.console import Console
    from rich.table import Table

    from usdface.cli.report import print_whole, shown

    table = Table(box=None, padding=(0, 2, 0, 0))
    for head in ("shot", "verdict"):
        table.add_column(head)
    for head in ("mean \\[mm]", "worst \\[mm]", "occluded", "correction"):
        table.add_column(head, justify="right")
    table.add_column("findings")
    table.add_column("run")
    for row in rows:
        lost = row.state in ("failed", "missing")
        verdict = row.state if lost else row.verdict.replace("_", " ")
        share = "" if row.occluded_share is None else f"{row.occluded_share:.1%}"
        numbers = map(_number, (row.residual_mean_mm, row.residual_max_mm))
        codes = [*row.reasons, *(code for code in row.findings if code not in row.reasons)]
        # The stages of a result that is kept are those of the run that made it.
        stages = row.stages.items() if row.state == "processed" else ()
        cached = [name for name, how in stages if how == "cached"]
        state = row.state + (f", {' and '.join(cached)} cached" if cached else "")
        why = row.code if row.error else ", ".join(codes)
        style = {"not_usable": "red", "look_at": "yellow"}.get(row.verdict, "red" if lost else "")
        cells = (row.name, verdict, *numbers, share, _number(row.correction_max), why, state)
        table.add_row(*(shown(cell) for cell in cells), style=style)
    print_whole(Console(highlight=False), table)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
