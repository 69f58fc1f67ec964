"""The commands `shot` and `markers`: bind a take to a rig, choose vertices for new markers."""

import argparse
import sys
from pathlib import Path
from typing import Any, TextIO

from usdface import pipeline
from usdface.cli.command import add_command, add_output, add_overwrite, report, settings
from usdface.cli.progress import progress
from usdface.errors import InputError
from usdface.options import BindOptions, CorrectionOptions, MarkerOptions

__all__ = ["add_markers", "add_shot"]


def add_shot(commands: Any, summary: str) -> None:
    """Add `usdface shot`."""
    command = add_command(
        commands,
        "shot",
        _shot,
        summary,
        writes=("write_bind", "bind_figure"),
    )
    command.add_argument(
        "--rig", type=Path, required=True, help="USD rig, as `usdface rig` makes it"
    )
    command.add_argument(
        "--take", type=Path, required=True, help="USD take, as `usdface take` makes it"
    )
    add_output(command, "the shot, .usda")
    add_overwrite(command)
    _binding_options(command.add_argument_group("binding of the markers"))
    _correction_options(command.add_argument_group("correction of the solved weights"))
    command.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE.json",
        help="calibration of the performer, from `usdface calibrate`",
    )
    for name, holds in (
        ("performer", "the calibration"),
        ("character", "rig, binding, expressions and fuzzy system"),
    ):
        command.add_argument(
            f"--{name}-layer",
            default="",
            metavar="FILE.usda",
            help=f"layer with {holds}, which the shot sublayers; written if it is not there",
        )


def _binding_options(group: Any) -> None:
    group.add_argument(
        "--bind", type=Path, help="vertices of the markers, JSON (default: proposed)"
    )
    group.add_argument(
        "--propose", action="store_true", help="propose vertices for markers that --bind leaves out"
    )
    group.add_argument(
        "--neutral",
        nargs="+",
        metavar="FRAME",
        help='first and last neutral frame index, or "auto"; overrides the binding (default: '
        "found, if the binding names none)",
    )
    group.add_argument(
        "--peaks",
        nargs="+",
        metavar="FRAME",
        help='frame indices of strong expressions to propose by, or "auto"; instead of the '
        "binding's",
    )
    group.add_argument(
        "--write-bind", type=Path, metavar="FILE.json", help="write the binding, for corrections"
    )
    group.add_argument(
        "--bind-figure",
        type=Path,
        metavar="FILE",
        help="draw the markers on the face: .png, .svg or .pdf",
    )
    group.add_argument(
        "--print-bind",
        action="store_true",
        help="print the binding as written; the report goes to standard error",
    )


def _correction_options(group: Any) -> None:
    default = CorrectionOptions()
    group.add_argument(
        "--fuzzy",
        type=Path,
        metavar="FILE",
        help="a fuzzy system to use, .usda, .fis, .fcl or .fll (default: designed for the rig)",
    )
    group.add_argument(
        "--expressions",
        type=Path,
        metavar="FILE",
        help="expression poses, also new ones: blend shapes or action units as JSON, or USD",
    )
    group.add_argument(
        "--mode",
        choices=("raise", "add"),
        help="how emotions are combined with the solved weights "
        f"(default: {default.mode}, or the system's)",
    )
    group.add_argument(
        "--gain",
        type=float,
        help="weights are raised to this much of a pose; 0.5 changes nothing where half of it "
        f"is performed (default: {default.gain:g}, or the system's)",
    )
    group.add_argument(
        "--ease",
        type=float,
        help="how far antagonists of raised blend shapes are lowered, 0 to 1 "
        f"(default: {default.ease:g}, or the system's)",
    )


def _shot(parsed: argparse.Namespace) -> int:
    overrides = {k: v for k, v in settings(parsed, CorrectionOptions).items() if v is not None}
    neutral = _frames("--neutral", parsed.neutral, "one or two frame indices", 2)
    peaks = _frames("--peaks", parsed.peaks, "frame indices")
    if isinstance(neutral, tuple):
        neutral = neutral[0], neutral[-1]
    binding = BindOptions(propose=parsed.propose, neutral=neutral, peaks=peaks)
    try:
        with progress(parsed) as step:
            result = pipeline.make_shot(
                parsed.rig,
                parsed.take,
                parsed.output,
                bind=parsed.bind,
                binding=binding,
                calibration=parsed.calibration,
                expressions=parsed.expressions,
                fuzzy=parsed.fuzzy,
                correction=overrides,
                write_bind=parsed.write_bind,
                figure=parsed.bind_figure,
                performer_layer=parsed.performer_layer,
                character_layer=parsed.character_layer,
                overwrite=parsed.overwrite,
                on_progress=step,
            )
    except InputError as error:
        if error.code == "BINDING_UNSURE":
            _print_unsure(parsed, error)
        raise
    status = report(parsed, result, file=sys.stderr if parsed.print_bind else None)
    if parsed.print_bind:
        _print_bind(result.value.setup, parsed.stdout)
    return status


def _print_unsure(parsed: argparse.Namespace, error: InputError) -> None:
    """Print a refused binding: the files with its proposal, or the binding itself."""
    for path in (parsed.write_bind, parsed.bind_figure):
        if path:
            print(f"wrote {path}", file=sys.stderr)
    if parsed.print_bind:
        _print_bind(error.setup, parsed.stdout)  # type: ignore[attr-defined]


def _print_bind(setup: Any, stdout: TextIO) -> None:
    from usdface.io.bind_file import bind_json

    print(bind_json(setup), end="", file=stdout)


def _frames(option: str, words: list[str] | None, expected: str, most: int = 1000) -> Any:
    """Return the frame indices of an option, "auto" or None."""
    if words is None or words == ["auto"]:
        return words and "auto"
    if len(words) > most or not all(word.isdecimal() and len(word) < 10 for word in words):
        raise InputError(f'{option} is {" ".join(words)!r}; expected {expected}, or "auto"')
    return tuple(int(word) for word in words)


def add_markers(commands: Any, summary: str) -> None:
    """Add `usdface markers`."""
    command = add_command(commands, "markers", _markers, summary, writes=("figure",))
    command.add_argument("rig", type=Path, help="USD rig, as `usdface rig` makes it")
    default = MarkerOptions()
    command.add_argument(
        "-n",
        "--count",
        type=int,
        default=default.count,
        help="how many markers (default: %(default)s)",
    )
    command.add_argument(
        "--bind", type=Path, help="binding of the markers that are there already, JSON"
    )
    command.add_argument(
        "--noise",
        type=float,
        default=default.noise,
        help="of a marker coordinate on a human face [m] (default: %(default)s)",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="the binding with the new markers"
    )
    command.add_argument(
        "--figure", type=Path, metavar="FILE", help="draw the places: .png, .svg, .pdf"
    )
    add_overwrite(command)


def _markers(parsed: argparse.Namespace) -> int:
    options = MarkerOptions(**settings(parsed, MarkerOptions))
    with progress(parsed) as step:
        result = pipeline.make_markers(
            parsed.rig,
            bind=parsed.bind,
            output=parsed.output,
            figure=parsed.figure,
            overwrite=parsed.overwrite,
            options=options,
            on_progress=step,
        )
    return report(parsed, result)
