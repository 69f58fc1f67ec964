"""Keyframe data of After Effects as text, which Mocha and others export.

A head of indented lines (``Units Per Second``, ``Source Width``, ...), then blocks: a line that
is not indented names the property, an indented one its columns, then a line for each key. Pixels
from the top left corner, frames from 0.
"""

from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, positive, read_text
from usdface.io.takes.track_text import read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_after_effects"]

# First cells of a property that say nothing, and a last one that each point control has.
_GROUPS = ("Effects", "Transform", "Motion Trackers")
_POINT = "Point"
# Properties with x and y in pixels that are no places, and, of a tracker, other than the feature's.
_NO_PLACES = ("Anchor Point", "Feature Size", "Search", "Attach Point", "Scale")


def read_after_effects(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake, list[Finding]]:
    """Read all properties that are points of the image; non-square pixels are made square.

    Raises
    ------
    InputError
        If the file is missing, no such text, or has no point.
    """
    text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
    head, blocks, skipped = _split(text)
    points = [(label, rows) for label, rows in blocks if rows]
    if not points:
        raise InputError(
            f"{path}: no property has keys in X pixels and Y pixels; expected a point control, "
            "a position or a corner pin",
            "TAKE_EMPTY",
        )
    table = read_blocks(path, points, 3)
    aspect = positive(head.get("source pixel aspect ratio", "")) or 1.0
    width, height = (positive(head.get(f"source {side}", "")) for side in ("width", "height"))
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:] * np.array([aspect, 1.0]),
        origin="top",
        first_frame=0,
        image_size=image_size(path, options, width, height, aspect),
        rate=positive(head.get("units per second", "")),
    )
    take, findings = finish_tracks(tracks, options)
    still = [label for label, rows in blocks if not rows]
    if skipped or still:
        message = "no points of the image that move, not read: {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, skipped + still))
    return take, findings


def _split(text: str) -> tuple[dict[str, str], list[tuple[str, list[Row]]], list[str]]:
    """Return the head, the points with their keys, and the other properties."""
    head: dict[str, str] = {}
    blocks: list[tuple[str, list[Row]]] = []
    skipped: list[str] = []
    label, picked = "", [0]
    rows: list[Row] | None = None  # None = no point, or its columns are still to come
    for number, line in enumerate(text.split("\n")[1:], 2):
        cells = [cell.strip() for cell in line.rstrip().split("\t")]
        if cells[0].lower().startswith("end of keyframe data"):
            break
        if cells[0]:
            label, rows = _label(cells), None
        elif len(cells) > 1 and cells[1].lower() == "frame":
            columns = [cell.lower() for cell in cells]
            if "x pixels" in columns and "y pixels" in columns and _is_place(label):
                rows = []
                blocks.append((label, rows))
                picked = [1, columns.index("x pixels"), columns.index("y pixels")]
            else:
                skipped.append(label)
        elif rows is not None and len(cells) > max(picked):
            if cells[1]:  # else a value without keys
                rows.append((number, [cells[column] for column in picked]))
        elif not label and len(cells) > 2:
            head[cells[1].lower()] = cells[2]
    return head, blocks, skipped


def _label(cells: list[str]) -> str:
    names = [cell for cell in cells if cell]
    if len(names) > 1 and names[0] in _GROUPS:
        names = names[1:]
    if len(names) > 1 and names[-1] == _POINT:
        names = names[:-1]
    return " ".join(names)


def _is_place(label: str) -> bool:
    return not any(words in label for words in _NO_PLACES)
