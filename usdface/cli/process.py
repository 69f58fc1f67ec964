"""The command `process`: solve a shot."""

import argparse
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface import pipeline
from usdface.cli.command import (
    EDITED_RESULT,
    add_asset_root,
    add_command,
    add_overwrite,
    add_skip_hook,
    report,
    settings,
)
from usdface.cli.option_rules import check_together
from usdface.cli.process_job import write_job
from usdface.cli.process_options import add_run_options, run_options
from usdface.cli.progress import progress
from usdface.errors import InputError
from usdface.options import DeliverOptions, ProcessOptions

if TYPE_CHECKING:
    from usdface.result import Result

__all__ = ["add_process"]

# Files of a result, by their options, which are arguments of `usdface.process`.
_OUTPUTS = ("output", "gltf", "figure", "sheet", "deliver", "in_place")
# All that has an effect on the result alone, not on its pieces.
_OF_RESULT = (
    *_OUTPUTS,
    *(part.name for part in fields(DeliverOptions)),
    *("cache", "overwrite", "strict"),
)
# Options of long takes by the one that they belong to, and by the one that ignores them.
_NEEDS = {
    **dict.fromkeys(("piece", "openjd", "workers"), "--pieces DIR"),
    "chunk": "--openjd DIR",
}
_EXCLUDES = {
    "openjd": ("piece", "workers"),
    "piece": (*_OUTPUTS, "overwrite", "cache"),
}


def add_process(commands: Any, summary: str) -> None:
    """Add `usdface process`."""
    command = add_command(
        commands,
        "process",
        _process,
        summary,
        writes=("gltf", "figure", "sheet", "deliver"),
    )
    command.add_argument("shot", type=Path, help="a shot, as `usdface shot` makes it")
    _add_files(command)
    _add_delivery(command)
    _add_switches(command)
    add_run_options(command)
    command.add_argument(
        "--cache",
        default="",
        metavar="DIR",
        help="keep the arrays of each stage, and compute only those that changed",
    )
    _add_pieces(command)
    add_asset_root(command)
    add_skip_hook(command)
    add_overwrite(command, EDITED_RESULT)
    result = command.add_mutually_exclusive_group()
    result.add_argument(
        "-o",
        "--output",
        default="",
        metavar="ROOT",
        help="root layer of the result (default: beside the shot, SHOT.usdface.usda)",
    )
    result.add_argument(
        "--in-place", action="store_true", help="add the layers to the shot's own subLayers"
    )


def _add_files(command: argparse.ArgumentParser) -> None:
    command.add_argument("--gltf", default="", metavar="FILE", help="also write .glb or .gltf")
    command.add_argument(
        "--figure", default="", metavar="FILE", help="also draw the take: .png, .svg or .pdf"
    )
    command.add_argument(
        "--sheet",
        default="",
        metavar="FILE",
        help="also draw the face at its peaks and worst frames, solved above corrected",
    )


def _add_switches(command: argparse.ArgumentParser) -> None:
    """Add the options for steps that are left out."""
    command.add_argument(
        "--no-express",
        dest="express",
        action="store_false",
        help="no correction: emotions stay as solved",
    )
    command.add_argument(
        "--no-head", dest="head", action="store_false", help="the character's head stays still"
    )


def _add_pieces(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("long takes")
    group.add_argument(
        "--pieces",
        default="",
        metavar="DIR",
        help="solve the take in pieces, which are kept there, and join them",
    )
    group.add_argument(
        "--piece",
        default="",
        metavar="N[-M]|estimates",
        help="only solve these pieces, from 0 on; estimates: only the estimates that they share",
    )
    group.add_argument(
        "--workers", type=int, help="processes for the pieces (default: one for each core)"
    )
    group.add_argument(
        "--openjd",
        default="",
        metavar="DIR",
        help="solve nothing: write the pieces as a job of Open Job Description",
    )
    group.add_argument(
        "--chunk", type=int, metavar="N", help="pieces in a task of that job (default: 1)"
    )


def _add_delivery(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("deliverable")
    group.add_argument(
        "--deliver",
        default="",
        metavar="FILE",
        help="also write the face animation alone, flattened: .usdc or .usda",
    )
    group.add_argument("--start", type=int, metavar="FRAME", help="first frame of the cut")
    group.add_argument("--end", type=int, metavar="FRAME", help="last frame of the cut")
    group.add_argument(
        "--handles", type=int, default=0, metavar="N", help="also N frames before and after the cut"
    )
    group.add_argument(
        "--rate",
        type=float,
        default=0.0,
        metavar="RATE",
        help="frames per second (default, and 0: the shot's)",
    )


def _process(parsed: argparse.Namespace) -> int:
    options = run_options(parsed)
    check_together(parsed, _NEEDS, _EXCLUDES)
    if parsed.workers is not None and parsed.workers < 1:
        raise InputError(f"--workers {parsed.workers}: expected 1 or more", "SETTING_WRONG")
    delivery = _delivery(parsed)
    if parsed.openjd:
        return write_job(parsed, _OF_RESULT)
    if parsed.pieces:
        solved = _solve_pieces(parsed, options)
        if parsed.piece:
            return report(parsed, solved)
    with progress(parsed) as step:
        result = pipeline.process(
            parsed.shot,
            **_outputs(parsed),
            delivery=delivery,
            overwrite=parsed.overwrite,
            asset_root=parsed.asset_root,
            strict=parsed.strict,
            cache=parsed.cache or None,
            pieces=parsed.pieces or None,
            skip_hooks=parsed.skip_hooks,
            options=options,
            on_progress=step,
        )
    return report(parsed, result)


def _delivery(parsed: argparse.Namespace) -> DeliverOptions:
    """Return the options of a deliverable; refuse them where there is none."""
    delivery = DeliverOptions(**settings(parsed, DeliverOptions))
    if delivery != DeliverOptions() and not parsed.deliver:
        raise InputError(
            "--start, --end, --handles and --rate are of a deliverable: --deliver FILE",
            "SETTING_WRONG",
        )
    return delivery


def _solve_pieces(parsed: argparse.Namespace, options: ProcessOptions) -> "Result[Any]":
    if not parsed.piece:
        _check_outputs(parsed)  # `process` does so, too, but after the pieces
    with progress(parsed) as step:
        return pipeline.solve_pieces(
            parsed.shot,
            parsed.pieces,
            index=parsed.piece,
            workers=parsed.workers,
            asset_root=parsed.asset_root,
            skip_hooks=parsed.skip_hooks,
            options=options,
            on_progress=step,
        )


def _check_outputs(parsed: argparse.Namespace) -> None:
    from usdface.pipeline.process_outputs import process_outputs

    process_outputs(**_outputs(parsed)).check(parsed.shot, parsed.overwrite)


def _outputs(parsed: argparse.Namespace) -> dict[str, Any]:
    return {name: getattr(parsed, name) for name in _OUTPUTS}
