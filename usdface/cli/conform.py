"""The command `conform`: a cut, and the takes that it was cut from."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, add_output, report
from usdface.cli.progress import progress

__all__ = ["add_conform"]


def add_conform(commands: Any, summary: str) -> None:
    """Add `usdface conform`."""
    command = add_command(commands, "conform", _conform, summary)
    command.add_argument("cut", type=Path, help=".otio or .edl; needs usdface[otio]")
    command.add_argument("takes", type=Path, nargs="+", metavar="TAKE", help="takes in USD")
    add_output(command, "the show file, .json, for `usdface sequence`")
    command.add_argument(
        "--show",
        type=Path,
        metavar="FILE",
        help="a show file in the same folder, whose characters, performers and options are used",
    )
    command.add_argument("--performer", default="", metavar="NAME", help="performer of all shots")
    command.add_argument(
        "--character",
        dest="characters",
        action="append",
        default=[],
        metavar="NAME",
        help="character of all shots; given again, a shot with each",
    )
    command.add_argument(
        "--handles", type=int, default=0, metavar="N", help="also N frames before and after a clip"
    )
    command.add_argument(
        "--rate",
        type=float,
        default=0.0,
        help="frames per second of the deliverables (default: the cut's)",
    )
    command.add_argument(
        "--timecode-rate",
        type=float,
        default=0.0,
        metavar="RATE",
        help="frames a second that the takes' timecodes count (default: those of each take)",
    )
    command.add_argument(
        "--cut-rate",
        type=float,
        default=0.0,
        metavar="RATE",
        help="frames a second that an .edl counts (default: 24; with drop frame 29.97)",
    )


def _conform(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.conform(
            parsed.cut,
            parsed.takes,
            parsed.output,
            show=parsed.show,
            performer=parsed.performer,
            characters=parsed.characters,
            handles=parsed.handles,
            rate=parsed.rate,
            timecode_rate=parsed.timecode_rate,
            cut_rate=parsed.cut_rate,
            on_progress=step,
        )
    return report(parsed, result)
