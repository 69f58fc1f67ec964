"""The command `calibrate`: a performer's gains."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, add_output, add_overwrite, add_skip_hook, report
from usdface.cli.progress import progress

__all__ = ["add_calibrate"]


def add_calibrate(commands: Any, summary: str) -> None:
    """Add `usdface calibrate`."""
    command = add_command(commands, "calibrate", _calibrate, summary)
    command.add_argument("shot", type=Path, help="a shot of an expressive take")
    add_output(command, "the calibration, .json, for shot --calibration")
    command.add_argument(
        "--extremes",
        action="store_true",
        help="the take is a range of motion: each movement goes to its extreme",
    )
    add_overwrite(command)
    add_skip_hook(command)


def _calibrate(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.calibrate(
            parsed.shot,
            parsed.output,
            extremes=parsed.extremes,
            overwrite=parsed.overwrite,
            skip_hooks=parsed.skip_hooks,
            on_progress=step,
        )
    return report(parsed, result)
