"""Common parts of all commands: shared options, the report, the exit status."""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from usdface.cli.examples import EXAMPLES
from usdface.cli.outcomes import describe
from usdface.cli.progress import PROGRESS
from usdface.errors import OutputError, unreadable

if TYPE_CHECKING:
    from usdface.result import Result

__all__ = [
    "DONE",
    "EDITED",
    "EDITED_RESULT",
    "FAILED",
    "add_asset_root",
    "add_command",
    "add_output",
    "add_overwrite",
    "add_skip_hook",
    "check_files",
    "options_of",
    "report",
    "settings",
]

DONE, FAILED = 0, 1
# Where outputs are kept without --overwrite.
EDITED = "they were edited since usdface wrote them, or are of another origin"
EDITED_RESULT = f"{EDITED} (an edit of a glTF does not show)"


def add_command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    summary: str,
    writes: Sequence[str] = (),
) -> argparse.ArgumentParser:
    """Add a command with the options that all have.

    Parameters
    ----------
    commands : argparse's sub-parsers
    name : str
    run : callable
        Returns the exit status.
    summary : str
    writes : sequence of str
        Options whose file the pipeline writes, beside ``output``; it also checks and lists them.
        Files that other options name are read.
    """
    command: argparse.ArgumentParser = commands.add_parser(name, help=summary)
    full_name = command.prog.partition(" ")[2]  # with that of its group: "fuzzy fit"
    command.formatter_class = argparse.RawDescriptionHelpFormatter
    command.description = describe(full_name, summary)
    command.epilog = "\n  ".join(("examples:", *EXAMPLES[full_name]))
    command.set_defaults(command=command, run=run, writes=("output", *writes))
    command.add_argument(
        "--format",
        choices=("text", "json"),
        default="text",
        help="of what is printed (default: text)",
    )
    command.add_argument(
        "--report",
        type=Path,
        metavar="FILE.json",
        help="also write the report: findings, figures and details as JSON",
    )
    command.add_argument(
        "--progress",
        choices=PROGRESS,
        default="auto",
        help="on standard error: a bar on a terminal (auto), lines, lines of JSON or for Open Job "
        "Description, or none",
    )
    command.add_argument(
        "--strict",
        action="store_true",
        help="a warning is a failure; process writes no result that is not usable",
    )
    command.add_argument(
        "--trusted",
        action="store_true",
        help="open USD files at once, without trying them in a process with limits first",
    )
    command.add_argument("--debug", action="store_true", help="show tracebacks")
    return command


def add_output(command: argparse.ArgumentParser, summary: str) -> None:
    """Add the required option ``--output``, a file."""
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help=summary)


def add_overwrite(command: argparse.ArgumentParser, where: str = EDITED) -> None:
    """Add the option ``--overwrite``; `where` names the outputs that are kept without it."""
    command.add_argument(
        "--overwrite", action="store_true", help=f"replace outputs also where {where}"
    )


def add_asset_root(command: argparse.ArgumentParser) -> None:
    """Add the option ``--asset-root``, a folder."""
    command.add_argument(
        "--asset-root",
        default="",
        metavar="DIR",
        help="also read textures and buffers from DIR (default: only from the asset's own folder)",
    )


def add_skip_hook(command: argparse.ArgumentParser) -> None:
    """Add the option ``--skip-hook``, which may be repeated."""
    command.add_argument(
        "--skip-hook",
        dest="skip_hooks",
        action="append",
        default=[],
        metavar="NAME",
        help="leave out the hooks of another package, or one of them: PACKAGE or PACKAGE:HOOK",
    )


def options_of(command: argparse.ArgumentParser) -> list[str]:
    """Return the options of a command, as they are written: ``--output``, ``-o``."""
    return [word for action in command._actions for word in action.option_strings]


def settings(parsed: argparse.Namespace, kind: Any) -> dict[str, Any]:
    """Return the parsed values that are fields of an options dataclass."""
    return {f.name: getattr(parsed, f.name) for f in fields(kind) if hasattr(parsed, f.name)}


def check_files(parsed: argparse.Namespace) -> None:
    """Validate the output files of the command line before any work.

    Raises
    ------
    InputError
        If the system refuses to look at an input.
    OutputError
        If a file is also an input or another output, or cannot be written, or the report is not
        named as a JSON file, or would replace one of another origin.
    """
    reports = _files(parsed, ("report",))
    if not reports:
        return
    from usdface.io.inputs import check_outputs, files_read
    from usdface.io.overwrite_protection import check_replaced

    if parsed.report and parsed.report.suffix.lower() != ".json":
        raise OutputError(
            f"cannot write {parsed.report}: the report is JSON; end its name in .json"
        )
    roles = {*parsed.writes, "report", "labels"}
    given = [value for name, value in vars(parsed).items() if name not in roles]
    listed = [v for value in given for v in (value if isinstance(value, list) else [value])]
    sources = (value for value in listed if isinstance(value, Path))
    try:
        read = files_read(*sources, labels=getattr(parsed, "labels", None))
    except OSError as error:
        raise unreadable(error) from error
    check_outputs((*_files(parsed, parsed.writes), *reports), read)
    overwrite = getattr(parsed, "overwrite", None)
    check_replaced(((place, "report") for place in reports), overwrite)


def _files(parsed: argparse.Namespace, names: Sequence[str]) -> tuple[Path, ...]:
    return tuple(Path(value) for name in names if (value := getattr(parsed, name, None)))


def report(
    parsed: argparse.Namespace,
    result: "Result[Any]",
    fail_on: Sequence[str] = (),
    file: TextIO | None = None,
) -> int:
    """Print and write the result of a command; return the exit status.

    Parameters
    ----------
    parsed : argparse.Namespace
    result : Result
    fail_on : sequence of str
        Severities of findings that are a failure, also without ``--strict``.
    file : stream, optional
        Where to print, instead of standard output.
    """
    from usdface.cli.report import print_result, write_report
    from usdface.findings import severest

    result = replace(result, written=(*result.written, *_files(parsed, ("report",))))
    # Before the text: a pipe may be closed after its first lines (`usdface ... | head`).
    if parsed.report:
        write_report(result, parsed.report)
    try:
        print_result(result, parsed.format, file or parsed.stdout)
    except OSError as error:
        error.filename = error.filename or "standard output"
        raise
    worst = severest(result.findings)
    if parsed.strict and worst in ("warning", "error"):
        print(_strictly(result), file=sys.stderr)
        return FAILED
    return FAILED if worst in fail_on else DONE


def _strictly(result: "Result[Any]") -> str:
    """Return the line that says why ``--strict`` fails a result, which may be called good."""
    codes = dict.fromkeys(f.code for f in result.findings if f.severity != "info")
    kept = "; the files above are written all the same" if result.written else ""
    return f"usdface: failed, as --strict counts warnings as errors: {', '.join(codes)}{kept}"
