"""The command line: parses, calls `usdface.pipeline`, prints; exit status 0, 1 or 2.

Each module has a group of commands with their options. Heavy libraries are imported only when a
command runs, so that `usdface --help` is fast.
"""

import argparse
import sys
from collections.abc import Sequence

from usdface import __version__
from usdface.blas_threads import limit_from_start
from usdface.cli.bench import add_bench
from usdface.cli.command import FAILED, check_files
from usdface.cli.convert import add_check, add_export, add_import, add_rig, add_take
from usdface.cli.formats import add_formats
from usdface.cli.fuzzy import add_fuzzy
from usdface.cli.process import add_calibrate, add_process
from usdface.cli.shot import add_markers, add_shot
from usdface.errors import UsdFaceError

__all__ = ["main"]

_COMMANDS = (
    add_rig,
    add_take,
    add_markers,
    add_shot,
    add_calibrate,
    add_process,
    add_export,
    add_import,
    add_check,
    add_formats,
    add_fuzzy,
    add_bench,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit status (argparse exits with 2 on wrong usage)."""
    limit_from_start()
    parsed = _parser().parse_args(arguments)
    try:
        check_files(parsed)
        status: int = parsed.run(parsed)
        return status
    except BrokenPipeError:
        return FAILED
    except KeyboardInterrupt:
        print("usdface: interrupted", file=sys.stderr)
        return FAILED
    except Exception as error:
        if parsed.debug:
            raise
        print(f"usdface: {_in_one_line(error)}", file=sys.stderr)
        if isinstance(error, UsdFaceError) and parsed.format == "json":
            import json  # only here: --help needs none

            print(json.dumps({"error": {"code": error.code, "message": str(error)}}))
        return FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="usdface",
        description="Marker takes onto blend-shape characters, in USD and glTF.",
        epilog="exit status: 0 done, 1 an error (one line says which), 2 wrong usage",
    )
    parser.add_argument("--version", action="version", version=f"usdface {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for add in _COMMANDS:
        add(commands)
    return parser


def _in_one_line(error: Exception) -> str:
    if isinstance(error, UsdFaceError):
        return f"{error} [{error.code}]"
    if isinstance(error, OSError):  # a name too long, a folder that may not be entered, a full disk
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or error}"
    summary = f"{type(error).__name__}: {error}".splitlines()[0]
    return f"a mistake in usdface: {summary}; --debug shows where"
