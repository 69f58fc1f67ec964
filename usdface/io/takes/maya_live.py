"""Tracked points of Maya Live.

``# Size width height [aspect of the device]``, perhaps ``# Pixels``, then for each point ``#
Name`` and lines ``point frame x y error``. Coordinates run from -aspect to aspect and from -1 to
1, right and up, or are pixels from the bottom left corner. Frames from 0. Format: Maya's help,
"Tracked point file format".
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, needed_image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, positive
from usdface.io.takes.track_text import numbered_lines, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_maya_live"]

_SIZE = re.compile(r"#\s*size\s+([0-9]{1,9})\s+([0-9]{1,9})(?:\s+(\S+))?", re.IGNORECASE)
_NAME = re.compile(r"#\s*name\s+(\S.*)", re.IGNORECASE)
_PIXELS = re.compile(r"#\s*pixels\b", re.IGNORECASE)
_ROUNDED = 0.01  # of an aspect with two decimals


def read_maya_live(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the points; non-square pixels are made square by stretching x.

    Raises
    ------
    InputError
        If the file is missing or no such export.
    """
    header, *lines = numbered_lines(path)
    size = _SIZE.match(header[1])
    if not size:
        raise InputError(
            f"{path}, line {header[0]}: {header[1][:40]!r}; expected # Size width height",
            "COLUMNS_WRONG",
        )
    blocks: list[tuple[str, list[Row]]] = []
    pixels = False
    for number, line in lines:
        if name := _NAME.match(line):
            blocks.append((name[1], []))
        elif line.startswith("#"):
            pixels = pixels or bool(_PIXELS.match(line))
        elif blocks:
            blocks[-1][1].append((number, line.split()))
        else:
            raise InputError(
                f"{path}, line {number}: a sample before any # Name; "
                "expected the name of its track above it",
                "ROW_WRONG",
            )
    table = read_blocks(path, blocks, 4)
    sides = float(size[1]), float(size[2])
    width, height = needed_image_size(path, options, "relative to the image", *sides)
    aspect = positive(size[3] or "")
    if not 0.01 < aspect < 100 or abs(aspect - width / height) < _ROUNDED:
        aspect = width / height
    square = aspect * height  # width of the image in square pixels
    places = table.numbers[:, 2:4]
    corner = np.zeros(2) if pixels else np.array([aspect, 1.0])
    scale = np.array([square / width, 1.0]) if pixels else np.full(2, height / 2)
    tracks = ImageTracks(
        path=path,
        table=replace(table, numbers=table.numbers[:, 1:]),
        places=(places + corner) * scale,
        origin="bottom",
        first_frame=0,
        image_size=(max(1, round(square)), height),
        ignored=("error",),
    )
    return finish_tracks(tracks, options)
