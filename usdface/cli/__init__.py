"""The command line: parses, calls `usdface.pipeline`, prints; returns the exit status.

Each module has a group of commands with their options. Heavy libraries are imported only when a
command runs, so that `usdface --help` is fast.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout, suppress
from functools import cache
from importlib import import_module
from io import StringIO, TextIOWrapper
from typing import Any, NoReturn, TextIO

from usdface import __version__
from usdface.blas_threads import limit_from_start
from usdface.cli.command import FAILED, check_files, options_of
from usdface.cli.examples import MAIN_JOB
from usdface.errors import UsdFaceError, did_you_mean
from usdface.plain_text import plain
from usdface.signals import say_stopped, was_stopped

__all__ = ["main"]

_LONGEST = 800  # characters of an error
_CLOSED = "closed"  # of a stream whose reader has left

# Each command with the module of its options, which is loaded when the command is named, and a
# line of help.
_COMMANDS = {
    "rig": ("convert", "convert a character to UsdSkel"),
    "take": ("convert", "convert a recorded take to USD"),
    "markers": ("shot", "choose the most informative vertices for markers"),
    "shot": ("shot", "bind a take to a rig, with expressions and a fuzzy system"),
    "calibrate": ("calibrate", "measure a performer's gains, relative to the character's shapes"),
    "process": ("process", "retarget a shot, correct its expressions, write layers"),
    "sequence": ("sequence", "process many shots: those that are out of date, in parallel"),
    "conform": ("conform", "write a show file for a cut: which range of which take, by timecode"),
    "bind": ("view", "write a page to check and move the places of markers: one HTML file"),
    "view": ("view", "write a page that shows a shot or a face: one HTML file"),
    "export": ("convert", "write a USD scene as glTF or USDZ"),
    "import": ("convert", "write a glTF as USD"),
    "check": ("convert", "check blend shapes of USD and glTF files"),
    "formats": ("formats", "list file formats, also those that other packages add"),
    "plugins": ("plugins", "list hooks, formats and hosts of other packages"),
    "fuzzy": ("fuzzy", "inspect, convert and fit fuzzy systems"),
    "bench": ("bench", "compute the published tables of the two methods again"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit status (argparse exits with 2 on wrong usage)."""
    limit_from_start()
    _write_anything()
    status = FAILED
    try:
        status = _run(_parsed(sys.argv[1:] if arguments is None else arguments))
    finally:
        printed = _print_rest(sys.stdout)
        if printed not in ("", _CLOSED) and status != FAILED:
            with suppress(OSError):
                print(f"usdface: standard output: {printed}", file=sys.stderr)
        _print_rest(sys.stderr)
    return FAILED if printed else status


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command; those that it does not have are refused with a hint."""
    parser = _parser(next((word for word in words if word in _COMMANDS), ""))
    first = next((word for word in words if not word.startswith("-")), None)
    if first is not None and first not in _COMMANDS:
        hint = did_you_mean(first, _COMMANDS) or "; `usdface --help` lists all"
        parser.error(f"there is no command {plain(first, _LONGEST)!r}{hint}")
    parsed, unknown = parser.parse_known_args(words)
    if unknown:
        command: argparse.ArgumentParser = parsed.command
        hint = did_you_mean(unknown[0].partition("=")[0], options_of(command))
        command.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
    return parsed


class _Parser(argparse.ArgumentParser):
    """A parser that names a misspelt option rather than the required one that it was meant for."""

    words: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self.words = args or ()
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        known = options_of(self)
        names = [word.partition("=")[0] for word in self.words if word.startswith("--")]
        unknown = [n for n in names if n != "--" and not any(k.startswith(n) for k in known)]
        if unknown and "unrecognized" not in message:
            hint = did_you_mean(unknown[0], known)
            message = f"unrecognized arguments: {' '.join(unknown)}{hint}"
        with suppress(OSError):  # standard error takes no more, which newer Pythons leave out
            super().error(message)
        raise SystemExit(2)


def _run(parsed: argparse.Namespace) -> int:
    """Run a command; print the one line of an error, return the exit status."""
    if parsed.trusted:
        os.environ["USDFACE_TRUSTED"] = "1"
    try:
        check_files(parsed)
        with _apart_from_others(parsed):
            status: int = parsed.run(parsed)
        return status
    except BrokenPipeError:
        return FAILED
    except KeyboardInterrupt:
        return say_stopped()
    except Exception as error:
        if was_stopped():
            return say_stopped()
        if parsed.debug:
            raise
        _say(error, as_json=parsed.format == "json")
        return FAILED


def _say(error: Exception, *, as_json: bool) -> None:
    """Print an error; a stream that takes no more is no other one."""
    message, code = _message_and_code(error)
    shown = f" [{code}]" if isinstance(error, UsdFaceError) else ""
    with suppress(OSError):
        print(f"usdface: {message}{shown}", file=sys.stderr)
    if as_json:
        import json  # only here: --help needs none

        with suppress(OSError):
            print(json.dumps({"error": {"code": code, "message": message}}))


def _apart_from_others(parsed: argparse.Namespace) -> AbstractContextManager[object]:
    """Keep standard output for the input of programs, JSON or a binding, in UTF-8 (RFC 8259, 8.1).

    Hooks and readers of other packages that print do so on standard error meanwhile.
    """
    parsed.stdout = sys.stdout
    alone = parsed.format == "json" or getattr(parsed, "print_bind", False)
    if alone and isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(encoding="utf-8")
    return redirect_stdout(sys.stderr) if alone and sys.stdout is not None else nullcontext()


def _print_rest(stream: TextIO | None) -> str:
    """Flush a stream; return the reason why it takes no more, "" if it does.

    Without this the interpreter would try at its end, complain in lines of its own about a pipe
    that was closed after its first lines (`usdface ... | head`), or a full disk, and exit with 120.
    """
    if stream is None:  # >&-
        return ""
    try:
        stream.flush()
    except OSError as error:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        return _CLOSED if isinstance(error, BrokenPipeError) else str(error.strerror)
    return ""


@cache
def _parser(command: str | None = None) -> argparse.ArgumentParser:
    """Make the parser, with the options of one command; without a name those of all."""
    parser = _Parser(
        prog="usdface",
        description="Marker takes onto blend-shape characters, in USD and glTF.",
        epilog="\n  ".join(("the main job:", *MAIN_JOB))
        + "\n\nexit status: 0 done, 1 an error (one line says which), 2 wrong usage,\n"
        "129 hung up, 130 interrupted, 143 terminated",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"usdface {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, (module, summary) in _COMMANDS.items():
        if command in (name, None):
            getattr(import_module(f"usdface.cli.{module}"), f"add_{name}")(commands, summary)
        else:
            commands.add_parser(name, help=summary)
    return parser


def _message_and_code(error: Exception) -> tuple[str, str]:
    """Return the one line of an error and its code, for a program."""
    if isinstance(error, UsdFaceError):
        return str(error), error.code
    if isinstance(error, OSError):  # a name too long, a folder that may not be entered, a full disk
        where = f"{error.filename}: " if error.filename else ""
        return plain(f"{where}{error.strerror or error}", _LONGEST), "FILE_UNREADABLE"
    if isinstance(error, UnicodeEncodeError) and error.reason.startswith("surrogates"):
        name = repr(plain(error.object, _LONGEST))
        return f"{name} is not UTF-8, as USD wants it; rename the file", "FILE_UNREADABLE"
    if isinstance(error, MemoryError):
        return "there is not enough memory for this", "TOO_LARGE"
    return _fault(error), "PROGRAM_FAULT"


def _fault(error: Exception) -> str:
    missing = error.name if isinstance(error, ModuleNotFoundError) else None
    if missing and missing.split(".")[0] != "usdface":
        return (
            f"the Python module {plain(missing, _LONGEST)} is not installed; "
            "`pip install usdface`, in a clone `pip install .`, installs all that usdface needs"
        )
    summary = plain(f"{type(error).__name__}: {error}".splitlines()[0], _LONGEST)
    return f"a mistake in usdface: {summary}; --debug shows where"


def _write_anything() -> None:
    """Escape characters that the terminal cannot print, and file names that are not UTF-8.

    A standard error that is closed (2>&-) is given a sink: `print` would take standard output.
    """
    if sys.stderr is None:
        sys.stderr = StringIO()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
