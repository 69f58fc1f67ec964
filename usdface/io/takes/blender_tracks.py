"""A folder with a CSV for each track, as scripts write them from Blender's movie clip editor.

Lines ``frame, x, y``, or ``x, y`` from frame 1 on; a header and ``nan`` may stand anywhere.
Coordinates run from 0 to 1 of the image's width and height, from the bottom left corner. The name
of a file is that of its track.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, needed_image_size, normalised
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, read_table
from usdface.io.takes.track_text import Block, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_blender_tracks"]

_MOST_FILES = 10_000
_LARGEST = 1 << 28  # bytes of all files


def read_blender_tracks(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake, list[Finding]]:
    """Read every CSV of a folder as a track.

    Raises
    ------
    InputError
        If a file is no such table, the folder is too large, or the size of the image is not given.
    """
    size = needed_image_size(path, options, "0 to 1")
    shown = (file for file in path.iterdir() if not file.name.startswith("."))
    files = sorted(file for file in shown if file.suffix.lower() == ".csv")
    if len(files) > _MOST_FILES or sum(file.stat().st_size for file in files) > _LARGEST:
        raise InputError(
            f"{path}: more than {_MOST_FILES} tracks or {_LARGEST >> 20} MiB; export fewer tracks",
            "TOO_LARGE",
        )
    table = read_blocks(path, [_block(file) for file in files], 3)
    places = normalised(path, table.numbers[:, 1:], "Blender")
    tracks = ImageTracks(
        path=path,
        table=replace(table, lines=()),
        places=np.asarray(places * size),
        origin="bottom",
        first_frame=1,
        image_size=size,
    )
    return finish_tracks(tracks, options)


def _block(file: Path) -> Block:
    rows: list[Row] = []
    for index, (line, cells) in enumerate(read_table(file)):
        if index == 0 and cells[0][:1].isalpha() and cells[0].lower() != "nan":
            continue
        # A row without a frame has that of its place in the file.
        rows.append((line, cells if len(cells) > 2 else [str(len(rows) + 1), *cells]))
    return file.stem, rows
