"""The command `bench`: the published tables of the two methods, computed again."""

import argparse
from pathlib import Path
from typing import Any

from usdface.cli.command import DONE, FAILED, add_command, reported, settings
from usdface.errors import InputError
from usdface.options import TakeOptions

__all__ = ["add_bench"]


def add_bench(commands: Any, summary: str) -> None:
    """Add `usdface bench`."""
    command = add_command(commands, "bench", _bench, summary)
    command.add_argument("name", choices=("papers", "solve"), metavar="papers")
    images = command.add_argument_group("images of a marked face, beside the default")
    images.add_argument(
        "--images",
        type=Path,
        metavar="FILM",
        help="a folder or pattern of images, or a 2D take: the RBF paper's way to the quantities "
        "of its Table I, beside ours (with --rig and --bind)",
    )
    images.add_argument("--rig", type=Path, help="the character")
    images.add_argument("--bind", type=Path, help="places of the markers, and neutral frames")
    images.add_argument(
        "--reference", type=Path, metavar="TAKE", help="performed weights: errors are shown"
    )
    images.add_argument(
        "--test-frame", type=int, metavar="FRAME", help="default: where the face moves most"
    )
    images.add_argument("--rate", "--fps", type=float, help="frames per second")
    images.add_argument("--focal-length", type=float, metavar="PX", help="of the camera [px]")
    images.add_argument("--dots", metavar="COLOUR", help="as of `usdface take`")
    images.add_argument("--names", type=Path, metavar="FILE", help="as of `usdface take`")
    # Of `solve`, which is a script of the repository now.
    command.add_argument("--data", type=Path, help=argparse.SUPPRESS)
    command.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)


def _bench(parsed: argparse.Namespace) -> int:
    from usdface.cli.report import print_json, print_written

    if parsed.name == "solve":
        raise InputError(
            "the benchmark of the solve is not part of the package: clone the repository and run "
            "`python -m benchmarks.solve` there"
        )
    if parsed.images or parsed.rig or parsed.bind:
        return _bench_images(parsed)
    from usdface.papers import tables

    computed = tables()
    if not print_json([table.as_dict() for table in computed], parsed.format, parsed.report):
        from usdface.cli.print_papers import print_papers

        print_papers(computed)
        print_written(reported(parsed))
    return DONE if all(table.within for table in computed) else FAILED


def _bench_images(parsed: argparse.Namespace) -> int:
    from usdface.cli.print_image_points import print_image_points
    from usdface.cli.report import print_json, print_written
    from usdface.pipeline.paper_images import compare_images

    if not (parsed.images and parsed.rig and parsed.bind):
        raise InputError(
            "--images FILM, --rig RIG and --bind BIND belong together", "SETTING_WRONG"
        )
    result, findings = compare_images(
        parsed.images,
        rig=parsed.rig,
        bind=parsed.bind,
        options=TakeOptions(**settings(parsed, TakeOptions)),
        reference=parsed.reference,
        test_frame=parsed.test_frame,
    )
    document = result.as_dict() | {"findings": [each.as_dict() for each in findings]}
    if not print_json(document, parsed.format, parsed.report):
        print_image_points(result, findings)
        print_written(reported(parsed))
    return DONE
