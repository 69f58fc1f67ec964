"""The commands below `fuzzy`: a look into the expression layer."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import DONE, add_command, add_output, check_figure, drawn, report
from usdface.cli.fuzzy_fit import add_fit
from usdface.cli.progress import progress

__all__ = ["add_fuzzy"]


def add_fuzzy(commands: Any) -> None:
    """Add `usdface fuzzy` with its actions."""
    summary = "look into the expression layer"
    group = commands.add_parser("fuzzy", help=summary, description=summary)
    actions = group.add_subparsers(title="actions", required=True, metavar="ACTION")
    command = add_command(
        actions, "explain", _explain, "why a frame gets its emotions", draws=("figure",)
    )
    command.add_argument("shot", type=Path)
    moment = command.add_mutually_exclusive_group()
    moment.add_argument(
        "--frame", type=int, help="frame index (default: where the strongest emotion is strongest)"
    )
    moment.add_argument("--time", type=float, metavar="SECONDS", help="the frame nearest to it")
    command.add_argument("--figure", type=Path, metavar="FILE", help="draw it: .png, .svg or .pdf")
    command = add_command(
        actions, "neutral", _neutral, "what a neutral face is answered, by paper and shot"
    )
    command.add_argument("shot", type=Path)
    command = add_command(actions, "convert", _convert, "between .fis, .fcl, .fll and USD")
    command.add_argument("source", type=Path, help="MATLAB .fis, FCL, FLL, or USD with one system")
    add_output(command, ".fis, .fcl, .fll, .usda or .usdc")
    summary = "write the fuzzy paper's system, as printed"
    command = add_command(actions, "paper", _paper, summary)
    add_output(command, ".fis, .fcl, .fll, .usda or .usdc")
    add_fit(actions)


def _explain(parsed: argparse.Namespace) -> int:
    from usdface.cli.report import print_json, print_written

    check_figure(parsed.figure)
    with progress(parsed.format == "text") as step:
        explained = pipeline.explain(parsed.shot, step)
    frame = explained.peak if parsed.frame is None else parsed.frame
    frame = frame if parsed.time is None else explained.frame_at(parsed.time)
    facts = explained.frame(frame)
    # Before the text, which somebody may read the beginning of only.
    if parsed.figure:
        from usdface.figures.explanation import write_explanation_figure

        write_explanation_figure(explained, frame, parsed.figure)
    if not print_json(facts, parsed.format, parsed.report):
        from usdface.cli.fuzzy_tables import print_explanation

        print_explanation(facts)
        print_written(drawn(parsed))
    return DONE


def _neutral(parsed: argparse.Namespace) -> int:
    from usdface.cli.report import print_json, print_written

    with progress(parsed.format == "text") as step:
        answers = pipeline.resting(parsed.shot, step)
    if not print_json([answer.as_dict() for answer in answers], parsed.format, parsed.report):
        from usdface.cli.fuzzy_tables import print_resting

        print_resting(answers)
        print_written(drawn(parsed))
    return DONE


def _convert(parsed: argparse.Namespace) -> int:
    with progress(parsed.format == "text") as step:
        outcome = pipeline.convert_fuzzy(parsed.source, parsed.output, step)
    return report(parsed, outcome)


def _paper(parsed: argparse.Namespace) -> int:
    with progress(parsed.format == "text") as step:
        outcome = pipeline.write_paper(parsed.output, step)
    return report(parsed, outcome)
