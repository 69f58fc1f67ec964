"""The commands `rig`, `take`, `export`, `import` and `check`: files in, files out."""

import argparse
from pathlib import Path
from typing import Any

from usdface import pipeline
from usdface.cli.command import (
    add_asset_root,
    add_command,
    add_output,
    add_overwrite,
    add_skip_hook,
    report,
    settings,
)
from usdface.cli.progress import progress
from usdface.io.export_targets import EXPORT_TARGETS
from usdface.io.format_table import FormatTable
from usdface.io.rigs.formats import RIG_READERS
from usdface.io.takes.formats import TAKE_READERS
from usdface.options import ExportOptions, ImportOptions, RigOptions, TakeOptions

__all__ = ["add_check", "add_export", "add_import", "add_rig", "add_take"]


def _formats(table: FormatTable[Any]) -> str:
    return f"{table.summary}; others: usdface formats"


def add_rig(commands: Any, summary: str) -> None:
    """Add `usdface rig`."""
    command = add_command(commands, "rig", _rig, summary)
    command.add_argument("source", type=Path, help=_formats(RIG_READERS))
    add_output(command, "the rig, .usda or .usdc")
    add_overwrite(command, "they are of another origin (an edit of a rig does not show)")
    default = RigOptions()
    command.add_argument(
        "--neutral",
        default="",
        metavar="NAME",
        help="neutral mesh of a folder (default: the one named so; of MakeHuman: base.obj)",
    )
    command.add_argument(
        "--meters-per-unit",
        type=float,
        metavar="METERS",
        default=default.meters_per_unit,
        help="unit of a folder's meshes (default: OBJ and PLY 0.01, centimetres; MakeHuman 0.1, "
        "decimetres)",
    )
    command.add_argument(
        "--up-axis",
        choices=("Y", "Z"),
        default=default.up_axis,
        help="of a folder's meshes (default: %(default)s)",
    )
    add_asset_root(command)


def _rig(parsed: argparse.Namespace) -> int:
    options = RigOptions(**settings(parsed, RigOptions))
    with progress(parsed) as step:
        result = pipeline.make_rig(
            parsed.source,
            parsed.output,
            overwrite=parsed.overwrite,
            options=options,
            on_progress=step,
        )
    return report(parsed, result)


def add_take(commands: Any, summary: str) -> None:
    """Add `usdface take`."""
    command = add_command(commands, "take", _take, summary, writes=("sheet",))
    command.add_argument("source", type=Path, nargs="+", help=_formats(TAKE_READERS))
    add_output(command, "the take, .usda or .usdc")
    add_overwrite(command, "they are of another origin (an edit of a take does not show)")
    _add_file_overrides(command.add_argument_group("where the file does not say, or is wrong"))
    _add_cameras(command.add_argument_group("several 2D takes of one performance"))
    _add_dots(command.add_argument_group("images of painted dots"))


def _add_file_overrides(group: Any) -> None:
    group.add_argument("--units", choices=("mm", "cm", "m", "in"), help="unit of length")
    group.add_argument("--up-axis", choices=("Y", "Z"), help="axis that points up")
    group.add_argument("--rate", "--fps", type=float, metavar="RATE", help="frames per second")
    group.add_argument(
        "--dimension",
        type=int,
        choices=(2, 3),
        help="2: x and y are pixels of an image, y down",
    )
    group.add_argument(
        "--image-size",
        type=int,
        nargs=2,
        metavar=("WIDTH", "HEIGHT"),
        help="of a 2D take [px]",
    )
    group.add_argument(
        "--focal-length", type=float, metavar="PX", help="of the camera of a 2D take [px]"
    )
    group.add_argument(
        "--start-timecode", metavar="HH:MM:SS:FF", help="SMPTE timecode of the first frame"
    )
    group.add_argument(
        "--confidence",
        type=float,
        help="0 to 1: samples of 2D tracks with less are occluded (default: the format's own)",
    )


def _add_cameras(group: Any) -> None:
    group.add_argument(
        "--cameras",
        type=Path,
        metavar="FILE",
        help="calibration of the cameras, in the order of the sources (.yml or .json of OpenCV, "
        ".toml)",
    )
    group.add_argument(
        "--sync",
        type=int,
        nargs="+",
        default=(),
        metavar="FRAME",
        help="a frame of each camera's footage, all of one moment, such as a clap",
    )


def _add_dots(group: Any) -> None:
    group.add_argument(
        "--dots",
        metavar="COLOUR",
        help="colour of the dots: green, #3a7 or the place x,y of one (default: it is found)",
    )
    group.add_argument(
        "--names",
        type=Path,
        metavar="FILE",
        help="names of the dots: rows of name, x, y and perhaps frame, CSV or JSON",
    )
    group.add_argument(
        "--bind",
        type=Path,
        metavar="FILE",
        help="binding to the --rig: the dots are named by where its vertices lie",
    )
    group.add_argument("--rig", type=Path, metavar="FILE", help="the character, for --bind")
    group.add_argument(
        "--fix",
        dest="fixes",
        type=Path,
        metavar="FILE",
        help="corrections of dots: rows of frame, name and x, y or hidden, JSON or CSV",
    )
    group.add_argument(
        "--sheet",
        type=Path,
        metavar="FILE",
        help="also draw every n-th image with its labelled dots: .png, .svg or .pdf",
    )


def _take(parsed: argparse.Namespace) -> int:
    if parsed.image_size:
        parsed.image_size = tuple(parsed.image_size)
    options = TakeOptions(**settings(parsed, TakeOptions))
    with progress(parsed) as step:
        result = pipeline.make_take(
            parsed.source,
            parsed.output,
            cameras=parsed.cameras,
            sync=parsed.sync,
            options=options,
            sheet=parsed.sheet,
            overwrite=parsed.overwrite,
            on_progress=step,
        )
    return report(parsed, result)


def add_export(commands: Any, summary: str) -> None:
    """Add `usdface export`."""
    command = add_command(commands, "export", _export, summary)
    command.add_argument(
        "scene", type=Path, help="a USD file: a result of `usdface process`, a rig, any scene"
    )
    add_output(command, _formats(EXPORT_TARGETS))
    add_overwrite(command, "they are glTF of another program (an edit does not show)")
    command.add_argument("--clip", default="", metavar="NAME", help="export only this clip")
    command.add_argument(
        "--pointer",
        action="store_true",
        help="also write a channel for each weight, by KHR_animation_pointer",
    )
    command.add_argument(
        "--quantize",
        action="store_true",
        help="points, normals and texture coordinates as 16-bit integers, by KHR_mesh_quantization",
    )
    command.add_argument(
        "--purpose",
        nargs="+",
        choices=("guide", "proxy"),
        default=(),
        help="also keep meshes of these purposes, which a render does not show",
    )
    command.add_argument(
        "--influences",
        type=int,
        default=0,
        metavar="N",
        help="joints that a point keeps at most, the strongest (default: all)",
    )
    add_asset_root(command)
    add_skip_hook(command)


def _export(parsed: argparse.Namespace) -> int:
    every = bool(parsed.report or parsed.strict)
    options = ExportOptions(**settings(parsed, ExportOptions))
    with progress(parsed) as step:
        result = pipeline.export_scene(
            parsed.scene,
            parsed.output,
            every_frame=every,
            overwrite=parsed.overwrite,
            skip_hooks=parsed.skip_hooks,
            options=options,
            on_progress=step,
        )
    return report(parsed, result)


def add_import(commands: Any, summary: str) -> None:
    """Add `usdface import`."""
    command = add_command(commands, "import", _import, summary)
    command.add_argument("source", type=Path, help="a glTF: .glb, .gltf or .vrm")
    add_output(command, "the scene, .usda or .usdc")
    add_overwrite(command, "they are of another origin (an edit of a rig does not show)")
    command.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="write this rig, USD or glTF, with the animations of the source, matched by name",
    )
    add_asset_root(command)


def _import(parsed: argparse.Namespace) -> int:
    every = bool(parsed.report or parsed.strict)
    options = ImportOptions(**settings(parsed, ImportOptions))
    with progress(parsed) as step:
        result = pipeline.import_scene(
            parsed.source,
            parsed.output,
            rig=parsed.rig,
            every_frame=every,
            overwrite=parsed.overwrite,
            options=options,
            on_progress=step,
        )
    return report(parsed, result)


def add_check(commands: Any, summary: str) -> None:
    """Add `usdface check`."""
    command = add_command(commands, "check", _check, summary, writes=("figure",))
    command.add_argument("files", type=Path, nargs="+", help="USD and glTF files")
    command.add_argument(
        "--facs",
        action="store_true",
        help="also judge blend shapes, expression poses and the peaks of a take by action units",
    )
    command.add_argument(
        "--figure",
        type=Path,
        metavar="FILE",
        help="with --facs, draw the verdicts: .png, .svg, .pdf",
    )


def _check(parsed: argparse.Namespace) -> int:
    with progress(parsed) as step:
        result = pipeline.check(
            parsed.files, facs=parsed.facs, figure=parsed.figure, on_progress=step
        )
    if parsed.facs and parsed.format == "text":
        from usdface.cli.print_facs import print_facs

        print_facs(result.details["facs"])
    return report(parsed, result, fail_on=("error",))
