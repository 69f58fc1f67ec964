"""The commands below `fuzzy`: inspect, convert and fit fuzzy systems."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, add_output, add_overwrite, add_skip_hook, report
from usdface.cli.fuzzy_fit import KEPT, add_fit
from usdface.cli.process_options import add_run_options, run_options
from usdface.cli.progress import progress

__all__ = ["add_fuzzy"]


def add_fuzzy(commands: Any, summary: str) -> None:
    """Add `usdface fuzzy` with its actions."""
    group = commands.add_parser("fuzzy", help=summary, description=summary)
    actions = group.add_subparsers(title="actions", required=True, metavar="ACTION")
    command = add_command(
        actions,
        "explain",
        _explain,
        "show the features, rules and weights of a frame",
        writes=("figure",),
    )
    command.add_argument("shot", type=Path, help="a shot, as `usdface shot` makes it")
    moment = command.add_mutually_exclusive_group()
    moment.add_argument(
        "--frame", type=int, help="frame index (default: peak of the strongest emotion)"
    )
    moment.add_argument(
        "--time", type=float, metavar="SECONDS", help="the frame nearest to this time"
    )
    command.add_argument(
        "--figure", type=Path, metavar="FILE", help="also draw the frame: .png, .svg, .pdf"
    )
    add_run_options(command)
    add_skip_hook(command)
    command = add_command(
        actions, "neutral", _neutral, "check which emotions fire on a neutral face"
    )
    command.add_argument("shot", type=Path, help="a shot, as `usdface shot` makes it")
    command = add_command(actions, "convert", _convert, "convert between .fis, .fcl, .fll and USD")
    command.add_argument("source", type=Path, help="MATLAB .fis, FCL, FLL, or USD with one system")
    add_output(command, ".fis, .fcl, .fll, .usda or .usdc")
    add_overwrite(command, KEPT)
    summary = "write the fuzzy system of the paper, as printed"
    command = add_command(actions, "paper", _paper, summary)
    add_output(command, ".fis, .fcl, .fll, .usda or .usdc")
    add_overwrite(command, KEPT)
    add_fit(actions)


def _explain(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.explain(
            parsed.shot,
            frame=parsed.frame,
            time=parsed.time,
            figure=parsed.figure,
            options=run_options(parsed),
            skip_hooks=parsed.skip_hooks,
            on_progress=step,
        )
    if parsed.format == "text":
        from usdface.cli.print_fuzzy import print_explanation

        print_explanation(result.details)
        result = replace(result, summary={})  # the first line has it
    return report(parsed, result)


def _neutral(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.check_neutral(parsed.shot, on_progress=step)
    if parsed.format == "text":
        from usdface.cli.print_fuzzy import print_neutral_responses

        print_neutral_responses(result.value)
    return report(parsed, result)


def _convert(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.convert_fuzzy(
            parsed.source, parsed.output, overwrite=parsed.overwrite, on_progress=step
        )
    return report(parsed, result)


def _paper(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.write_paper_system(
            parsed.output, overwrite=parsed.overwrite, on_progress=step
        )
    return report(parsed, result)
