"""Tracks of 3DEqualizer: the point exports of versions 4 and 3.

Pixels from the bottom left corner, frames from 1. Version 4: the number of points, then for each
its name, colour, number of samples and lines ``frame x y``. Version 3 begins with the size of the
image; names stand at the beginning of a line, samples are indented.
"""

import re
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, read_text
from usdface.io.takes.track_text import Block, announced_blocks, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_3de3", "read_3de4"]

_HEADER = re.compile(r"//\s*3DE Multiple Tracking Curves.*?([0-9]+)\s*x\s*([0-9]+)", re.IGNORECASE)


def read_3de4(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read points that 3DEqualizer 4 exported.

    Raises
    ------
    InputError
        If the file is missing, no such export, or ends early.
    """
    blocks = announced_blocks(path, ("colour",))
    return _take(path, blocks, image_size(path, options), ("colour",), options)


def read_3de3(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read points that 3DEqualizer 3 exported.

    Raises
    ------
    InputError
        If the file is missing or no such export.
    """
    text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
    header, *lines = text.lstrip().split("\n")
    size = _HEADER.match(header)
    if not size:
        raise InputError(
            f"{path}: line 1 is {header[:60]!r}; expected // 3DE Multiple Tracking Curves Export "
            "and the size of the image",
            "COLUMNS_WRONG",
        )
    blocks: list[tuple[str, list[Row]]] = []
    for number, line in enumerate(lines, 2):
        if not line.strip():
            continue
        if not line[0].isspace():
            blocks.append((line.strip(), []))
        elif blocks:
            blocks[-1][1].append((number, line.split()))
        else:
            raise InputError(
                f"{path}, line {number}: a sample before any name; "
                "expected the name of its point above it",
                "ROW_WRONG",
            )
    width, height = (float(side[:9]) for side in size.groups())
    return _take(path, blocks, image_size(path, options, width, height), (), options)


def _take(
    path: Path,
    blocks: list[Block] | list[tuple[str, list[Row]]],
    size: tuple[int, int] | None,
    ignored: tuple[str, ...],
    options: TakeOptions,
) -> tuple[MarkerTake, list[Finding]]:
    table = read_blocks(path, blocks, 3)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:],
        origin="bottom",
        first_frame=1,
        image_size=size,
        ignored=ignored,
    )
    return finish_tracks(tracks, options)
