"""Tracks of MatchMover and ImageModeler (.rz2).

``imageSequence "name" { width height f( "file" ) b( first last step ) }``, then for each track
``pointTrack "name" rgb( ... ) { ... }`` with lines ``frame x y`` and, as ``p+( 0.95 )``, how well
the pattern fitted; ``ki( ... )`` marks a place that the user set. Pixels from the top left
corner.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row
from usdface.io.takes.track_text import Block, Line, numbered_lines, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_matchmover"]

_SIZE = re.compile(r"([0-9]{1,9})\s+([0-9]{1,9})")
_RANGE = re.compile(r"b\(\s*([0-9]{1,9})\s+[0-9]+\s+[0-9]+\s*\)")
_FIT = re.compile(r"p[*+]\(\s*([^\s()]+)\s*\)")
_NAME = re.compile(r'"([^"]*)"')


def read_matchmover(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake, list[Finding]]:
    """Read the tracks; the fit of the pattern is the confidence of a sample.

    Raises
    ------
    InputError
        If the file is missing, has no image sequence, or a track does not end.
    """
    lines = numbered_lines(path)
    if not lines[0][1].startswith("imageSequence"):
        raise InputError(
            f"{path}: line 1 is {lines[0][1][:40]!r}; expected imageSequence", "COLUMNS_WRONG"
        )
    sequence = ""
    blocks: list[Block] = []
    for begin, block in _blocks(path, lines):
        if begin.startswith("imageSequence"):
            sequence = sequence or " ".join(text for _, text in block)
        elif begin.startswith("pointTrack"):
            name = _NAME.search(begin)
            blocks.append((name[1] if name else "", [_row(line) for line in block]))
    size = _SIZE.match(sequence)
    if not size:
        raise InputError(
            f"{path}: the image sequence has no size; "
            "expected its width and height in imageSequence",
            "COLUMNS_WRONG",
        )
    first = _RANGE.search(sequence)
    table = read_blocks(path, blocks, 4)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:3],
        origin="top",
        first_frame=int(first[1]) if first else 1,
        image_size=image_size(path, options, float(size[1]), float(size[2])),
        confidence=np.nan_to_num(table.numbers[:, 3], nan=1.0),
        ignored=("colour", "sizes of pattern and search"),
    )
    return finish_tracks(tracks, options)


def _blocks(path: Path, lines: list[Line]) -> Iterator[tuple[str, list[Line]]]:
    """Yield each line before braces, and the lines between them."""
    begin = lines[0]
    inside: list[Line] | None = None
    for line in lines:
        if line[1] == "{" and inside is None:
            inside = []
        elif inside is None:
            begin = line
        elif line[1].startswith("}"):
            yield begin[1], inside
            inside = None
        else:
            inside.append(line)
    if inside is not None:
        raise InputError(
            f"{path}, line {begin[0]}: the block does not end; "
            "expected a closing }; export or copy it again",
            "FILE_CUT_OFF",
        )


def _row(line: Line) -> Row:
    number, text = line
    fit = _FIT.search(text)
    return number, [*text.split()[:3], fit[1] if fit else ""]
