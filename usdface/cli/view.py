"""The commands `view` and `bind`: pages, to look at a shot and to place markers."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_asset_root, add_command, add_output, report, settings
from usdface.cli.progress import progress
from usdface.options import BindOptions, ViewOptions

__all__ = ["add_bind", "add_view"]


def add_view(commands: Any, summary: str) -> None:
    """Add `usdface view`."""
    command = add_command(commands, "view", _view, summary)
    command.add_argument(
        "source", type=Path, help="result of `usdface process`, or USD or glTF with blend shapes"
    )
    add_output(command, "the page, .html")
    command.add_argument(
        "--face-only", action="store_true", help="leave out meshes that no blend shape moves"
    )
    command.add_argument(
        "--no-textures", dest="textures", action="store_false", help="plain colours of materials"
    )
    command.add_argument(
        "--footage",
        type=Path,
        metavar="IMAGES",
        help="images that the take was made of: every n-th one with its labelled dots",
    )
    command.add_argument(
        "--tracks",
        type=Path,
        metavar="FILE.json",
        help="with --footage: report of the take, whose confidence colours the dots",
    )
    add_asset_root(command)


def _view(parsed: argparse.Namespace) -> int:
    options = ViewOptions(**settings(parsed, ViewOptions))
    with progress(parsed) as step:
        result = pipeline.view(parsed.source, parsed.output, options=options, on_progress=step)
    return report(parsed, result)


def add_bind(commands: Any, summary: str) -> None:
    """Add `usdface bind`."""
    command = add_command(commands, "bind", _bind, summary)
    command.add_argument("source", type=Path, help="rig, as `usdface rig` makes it, or a shot")
    command.add_argument("--take", type=Path, help="USD take, as `usdface take` makes it")
    command.add_argument(
        "--bind", type=Path, help="a binding to begin with, JSON (default: proposed, or the shot's)"
    )
    command.add_argument(
        "--propose", action="store_true", help="propose vertices for markers that --bind leaves out"
    )
    add_output(command, "the page, .html; it saves bind.json")


def _bind(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.make_bind_page(
            parsed.source,
            parsed.output,
            take=parsed.take,
            bind=parsed.bind,
            binding=BindOptions(propose=parsed.propose),
            on_progress=step,
        )
    return report(parsed, result)
