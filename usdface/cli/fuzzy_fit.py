"""The command `fuzzy fit`: a system from poses or labelled takes."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, add_output, add_overwrite, report, settings
from usdface.cli.progress import progress
from usdface.errors import InputError
from usdface.options import FitOptions

__all__ = ["KEPT", "add_fit"]

# Where the actions of `fuzzy` keep a file.
KEPT = "they are USD files other than a fuzzy system (an edit of one does not show)"


def add_fit(actions: Any) -> None:
    """Add `usdface fuzzy fit`."""
    command = add_command(
        actions,
        "fit",
        _fit,
        "design or learn a system from poses or labelled takes",
        writes=("expressions", "figure"),
    )
    source = command.add_mutually_exclusive_group(required=True)
    source.add_argument("--shot", type=Path, help="face, binding and expression poses")
    source.add_argument("--rig", type=Path, help="USD rig, with --bind")
    command.add_argument("--bind", type=Path, help="binding of the markers to --rig, JSON")
    command.add_argument(
        "--labels",
        type=Path,
        help="CSV or JSON: take, start_s and end_s or start_frame and end_frame, emotion, variant, "
        "intensity (default: the rig's own expression poses)",
    )
    add_output(command, ".usda, .usdc, .fis, .fcl or .fll")
    add_overwrite(command, KEPT)
    command.add_argument(
        "--expressions", type=Path, metavar="FILE.json", help="also write the expression poses"
    )
    command.add_argument(
        "--figure", type=Path, metavar="FILE", help="draw memberships and the confusion matrix"
    )
    default = FitOptions()
    command.add_argument(
        "--paper",
        action="store_true",
        help="design by the paper: terms from minimum, median, maximum",
    )
    command.add_argument(
        "--space",
        choices=("character", "take"),
        default=default.space,
        help="measure features on the character, after the solve, or on the markers of the take, "
        "before it (default: %(default)s)",
    )
    command.add_argument(
        "--hold-out",
        choices=("auto", "recording", "variant"),
        default=default.hold_out,
        help="group that each cross-validation fold holds out (default: %(default)s)",
    )


def _fit(parsed: argparse.Namespace) -> int:
    if bool(parsed.rig) != bool(parsed.bind):
        raise InputError("--rig and --bind belong together: give both, or --shot alone")
    options = FitOptions(**settings(parsed, FitOptions))
    with progress(parsed) as step:
        result = pipeline.fit_fuzzy(
            parsed.shot or parsed.rig,
            parsed.output,
            bind=parsed.bind,
            labels=parsed.labels,
            poses=parsed.expressions,
            figure=parsed.figure,
            options=options,
            overwrite=parsed.overwrite,
            on_progress=step,
        )
    if parsed.format == "text":
        from usdface.cli.print_fuzzy import print_fit

        print_fit(result.value)
    return report(parsed, result)
