"""What all commands share: common options, where options go, the report, the exit status."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from usdface.errors import OutputError

if TYPE_CHECKING:
    from usdface.result import Result

__all__ = [
    "DONE",
    "FAILED",
    "add_asset_root",
    "add_command",
    "add_output",
    "check_figure",
    "check_report",
    "report",
    "settings",
]

DONE, FAILED = 0, 1


def add_command(
    commands: Any, name: str, run: Callable[[argparse.Namespace], int], summary: str
) -> argparse.ArgumentParser:
    """Add a command with the options that all have; `run` returns its exit status."""
    command: argparse.ArgumentParser = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    command.add_argument("--format", choices=("text", "json"), default="text", help="of the report")
    command.add_argument("--report", type=Path, metavar="FILE.json", help="also write it as JSON")
    command.add_argument("--strict", action="store_true", help="a warning is a failure")
    command.add_argument("--debug", action="store_true", help="show tracebacks")
    return command


def add_output(command: argparse.ArgumentParser, what: str) -> None:
    """Add the required option ``--output``, a file."""
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help=what)


def add_asset_root(command: argparse.ArgumentParser) -> None:
    """Add the option ``--asset-root``, a folder."""
    command.add_argument(
        "--asset-root",
        default="",
        metavar="DIR",
        help="also read textures and buffers from DIR (default: only from the asset's own folder)",
    )


def settings(parsed: argparse.Namespace, kind: Any) -> dict[str, Any]:
    """Return the parsed values that are fields of an options dataclass."""
    return {f.name: getattr(parsed, f.name) for f in fields(kind) if hasattr(parsed, f.name)}


def check_report(parsed: argparse.Namespace) -> None:
    """Refuse a place for the report where it would take that of another file.

    Raises
    ------
    OutputError
        If it would, or its name is not that of a JSON file.
    """
    from usdface.io.atomic import check_place

    if parsed.report.suffix.lower() != ".json":
        raise OutputError(
            f"cannot write {parsed.report}: the report is JSON; end its name in .json"
        )
    others = [value for name, value in vars(parsed).items() if name != "report"]
    check_place(parsed.report, *(value for value in others if isinstance(value, Path)))


def check_figure(figure: Path | None) -> None:
    """Refuse, before the work, a name that is no picture's; without a name there is no figure.

    Raises
    ------
    InputError
        If it ends in something else.
    """
    if figure:
        from usdface.figures.picture import check_picture

        check_picture(figure)


def report(
    parsed: argparse.Namespace,
    outcome: "Result",
    fail_on: Sequence[str] = (),
    file: TextIO | None = None,
) -> int:
    """Print and write what came of a command; return the exit status.

    Parameters
    ----------
    parsed : argparse.Namespace
    outcome : Result
    fail_on : sequence of str
        Severities of findings that are a failure, also without ``--strict``.
    file : stream, optional
        Where to print, instead of standard output.
    """
    from usdface.cli.report import print_outcome, write_report
    from usdface.findings import severest

    print_outcome(outcome, parsed.format, file)
    if parsed.report:
        write_report(outcome, parsed.report)
    worst = severest(outcome.findings)
    strict = parsed.strict and worst in ("warning", "error")
    return FAILED if strict or worst in fail_on else DONE
