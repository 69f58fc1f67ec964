"""The command `bench`: the published tables of the two methods, computed again."""

import argparse
from pathlib import Path
from typing import Any

from usdface.cli.command import FAILED, add_command, report, settings
from usdface.errors import InputError
from usdface.options import TakeOptions

__all__ = ["add_bench"]


def add_bench(commands: Any, summary: str) -> None:
    """Add `usdface bench`."""
    command = add_command(commands, "bench", _bench, summary)
    command.add_argument(
        "name", choices=("papers", "solve"), metavar="papers", help="the tables of both papers"
    )
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
        "--test-frame",
        type=int,
        metavar="FRAME",
        help="frame index that is compared (default: where the face moves most)",
    )
    images.add_argument("--rate", "--fps", type=float, help="frames per second")
    images.add_argument("--focal-length", type=float, metavar="PX", help="of the camera [px]")
    images.add_argument("--dots", metavar="COLOUR", help="as of `usdface take`")
    images.add_argument("--names", type=Path, metavar="FILE", help="as of `usdface take`")
    # Of `solve`, which is a script of the repository now.
    command.add_argument("--data", type=Path, help=argparse.SUPPRESS)
    command.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)


def _bench(parsed: argparse.Namespace) -> int:
    if parsed.name == "solve":
        raise InputError(
            "the benchmark of the solve is not part of the package; clone the repository and run "
            "`python -m benchmarks.solve` there"
        )
    if parsed.images or parsed.rig or parsed.bind:
        return _bench_images(parsed)
    from usdface.papers import tables
    from usdface.result import Result

    computed = tables()
    if parsed.format == "text":
        from usdface.cli.print_papers import print_papers

        print_papers(computed)
    details = {"tables": [table.as_dict() for table in computed]}
    status = report(parsed, Result(None, details=details))
    return status if all(table.within for table in computed) else FAILED


def _bench_images(parsed: argparse.Namespace) -> int:
    if not (parsed.images and parsed.rig and parsed.bind):
        raise InputError(
            "--images FILM, --rig RIG and --bind BIND belong together; give all three",
            "SETTING_WRONG",
        )
    from usdface.pipeline.paper_images import compare_images
    from usdface.result import Result

    points, findings = compare_images(
        parsed.images,
        rig=parsed.rig,
        bind=parsed.bind,
        options=TakeOptions(**settings(parsed, TakeOptions)),
        reference=parsed.reference,
        test_frame=parsed.test_frame,
    )
    if parsed.format == "text":
        from usdface.cli.print_image_points import print_image_points

        print_image_points(points)
    return report(parsed, Result(None, findings=tuple(findings), details=points.as_dict()))
