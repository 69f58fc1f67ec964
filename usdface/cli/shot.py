"""The commands `shot` and `markers`: where markers sit, and what comes together by them."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface import pipeline
from usdface.cli.command import add_command, add_output, check_figure, report, settings
from usdface.cli.progress import progress
from usdface.errors import InputError
from usdface.options import BindOptions, CorrectionOptions, MarkerOptions

if TYPE_CHECKING:
    from usdface.retarget_setup import Binding

__all__ = ["add_markers", "add_shot"]


def add_shot(commands: Any) -> None:
    """Add `usdface shot`."""
    command = add_command(commands, "shot", _shot, "bring a rig and a take together")
    command.add_argument(
        "--rig", type=Path, required=True, help="USD rig, as `usdface rig` makes it"
    )
    command.add_argument(
        "--take", type=Path, required=True, help="USD take, as `usdface take` makes it"
    )
    add_output(command, "the shot, .usda")
    _binding_options(command.add_argument_group("where the markers sit"))
    _correction_options(command.add_argument_group("what goes over the solved weights"))
    command.add_argument(
        "--calibration", type=Path, metavar="FILE.json", help="of the performer, by calibrate"
    )


def _binding_options(group: Any) -> None:
    group.add_argument(
        "--bind", type=Path, help="where the markers sit, JSON (without: places are proposed)"
    )
    group.add_argument(
        "--propose", action="store_true", help="propose places for the markers --bind leaves out"
    )
    group.add_argument(
        "--neutral",
        nargs="+",
        metavar="FRAME",
        help='first and last neutral frame index, or "auto"; instead of the binding\'s',
    )
    group.add_argument(
        "--peaks",
        nargs="+",
        metavar="FRAME",
        help='frame indices of strong expressions to propose by, or "auto"; instead of the '
        "binding's",
    )
    group.add_argument(
        "--write-bind", type=Path, metavar="FILE.json", help="write the binding, to correct it"
    )
    group.add_argument(
        "--bind-figure", type=Path, metavar="FILE", help="draw the markers on the face: .png, ..."
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
        help="expressions to use, also new ones: shapes or action units as JSON, or USD",
    )
    group.add_argument(
        "--mode",
        choices=("raise", "add"),
        help=f"how emotions go over the solved weights (default: {default.mode}, or the system's)",
    )
    group.add_argument(
        "--gain", type=float, help=f"their strength (default: {default.gain:g}, or the system's)"
    )
    group.add_argument(
        "--ease",
        type=float,
        help="how far shapes that oppose what is raised go back, 0 to 1 "
        f"(default: {default.ease:g}, or the system's)",
    )


def _shot(parsed: argparse.Namespace) -> int:
    from usdface.io.atomic import all_or_none, check_place, write_text
    from usdface.io.bind_file import bind_json

    told = {k: v for k, v in settings(parsed, CorrectionOptions).items() if v is not None}
    neutral = _frames("--neutral", parsed.neutral, "one or two frame indices", 2)
    peaks = _frames("--peaks", parsed.peaks, "frame indices")
    if isinstance(neutral, tuple):
        neutral = neutral[0], neutral[-1]
    binding = BindOptions(propose=parsed.propose, neutral=neutral, peaks=peaks)
    others = (parsed.rig, parsed.take, parsed.output, *([parsed.bind] if parsed.bind else []))
    for place in (parsed.write_bind, parsed.bind_figure):
        if place:
            check_place(place, *others)
    check_figure(parsed.bind_figure)
    # All before the text, which somebody may read the beginning of only.
    with all_or_none():
        with progress(parsed.format == "text") as step:
            outcome, setup = pipeline.make_shot(
                parsed.rig,
                parsed.take,
                parsed.bind,
                parsed.output,
                told,
                step,
                parsed.fuzzy,
                parsed.expressions,
                binding,
                parsed.calibration,
            )
        if parsed.write_bind:
            write_text(parsed.write_bind, bind_json(setup))
        if parsed.bind_figure:
            _draw(parsed.rig, setup.binding, parsed.bind_figure)
    status = report(parsed, outcome, file=sys.stderr if parsed.print_bind else None)
    if parsed.print_bind:
        print(bind_json(setup), end="")
    return status


def _frames(option: str, words: list[str] | None, expected: str, most: int = 1000) -> Any:
    """Return what an option says: frame indices, "auto" or None."""
    if words is None or words == ["auto"]:
        return words and "auto"
    if len(words) > most or not all(word.isdecimal() and len(word) < 10 for word in words):
        raise InputError(f'{option} is {" ".join(words)!r}; expected {expected}, or "auto"')
    return tuple(int(word) for word in words)


def add_markers(commands: Any) -> None:
    """Add `usdface markers`."""
    summary = "find where markers would tell most of a character's blend shapes"
    command = add_command(commands, "markers", _markers, summary)
    command.add_argument("rig", type=Path, help="USD rig, as `usdface rig` makes it")
    default = MarkerOptions()
    command.add_argument(
        "-n",
        "--count",
        type=int,
        default=default.count,
        help="how many markers (default: %(default)s)",
    )
    command.add_argument("--bind", type=Path, help="the markers that are there, JSON")
    command.add_argument(
        "--noise",
        type=float,
        default=default.noise,
        help="of a marker coordinate [m] (default: %(default)s)",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="the binding with the new markers"
    )
    command.add_argument("--figure", type=Path, metavar="FILE", help="draw them: .png, .svg, .pdf")


def _markers(parsed: argparse.Namespace) -> int:
    options = MarkerOptions(**settings(parsed, MarkerOptions))
    from usdface.io.atomic import all_or_none

    check_figure(parsed.figure)
    with all_or_none():
        with progress(parsed.format == "text") as step:
            outcome, binding = pipeline.make_markers(
                parsed.rig, parsed.bind, parsed.output, options, step
            )
        if parsed.figure:
            _draw(parsed.rig, binding, parsed.figure)
    return report(parsed, outcome)


def _draw(rig: Path, binding: "Binding", figure: Path) -> None:
    from usdface.figures.binding import write_bind_figure
    from usdface.io.usd.rig import read_rig

    character, _ = read_rig(rig)
    write_bind_figure(character.mesh(binding.mesh), binding, figure)
