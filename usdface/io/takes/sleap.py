"""Points of SLEAP as analysis CSV.

Columns ``track, frame_idx, instance.score`` and ``x``, ``y``, ``score`` of each part; a row for
each instance in a frame. Pixels, the centre of the top left one is (0, 0).
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS, check_size
from usdface.io.takes.text_table import read_table
from usdface.io.takes.wide_tracks import samples_of_columns
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_sleap"]

_THRESHOLD = 0.2  # SLEAP's own for peaks of a confidence map, `peak_threshold`


def read_sleap(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the points of every instance; the score of a point is its confidence.

    Raises
    ------
    InputError
        If the file is missing or no such table.
    """
    (_, header), *rows = read_table(path)
    if header[:3] != ["track", "frame_idx", "instance.score"]:
        raise InputError(
            f"{path}: expected the columns track, frame_idx, instance.score", "COLUMNS_WRONG"
        )
    columns = {name: column for column, name in enumerate(header)}
    parts = [name.removesuffix(".x") for name in header[3:] if name.endswith(".x")]
    scored = all(f"{part}.score" in columns for part in parts)
    kinds = ("x", "y", "score") if scored else ("x", "y")
    absent = [f"{part}.y" for part in parts if f"{part}.y" not in columns]
    if absent or not parts:
        raise InputError(
            f"{path}: there is no column {(absent or ['.x'])[0]}; "
            "expected x and y of each part, as sleap-convert writes them",
            "COLUMNS_WRONG",
        )
    points = [(part, [columns[f"{part}.{kind}"] for kind in kinds]) for part in parts]
    table = samples_of_columns(path, rows, 1, points)
    instances = {name: n for n, name in enumerate(dict.fromkeys(cells[0] for _, cells in rows))}
    check_size(path, 1, len(instances) * len(parts))
    row_of = np.array([instances[cells[0]] for _, cells in rows], dtype=np.int64)
    labels = tuple(f"{name}:{part}" if name else part for name in instances for part in parts)
    tracks = np.repeat(row_of, len(parts)) * len(parts) + table.tracks
    samples = ImageTracks(
        path=path,
        table=replace(table, labels=labels, tracks=tracks),
        places=table.numbers[:, 1:3] + 0.5,
        origin="top",
        first_frame=0,
        image_size=image_size(path, options),
        confidence=table.numbers[:, 3] if scored else None,
        threshold=_THRESHOLD,
        ignored=["instance.score", *_unread(header, parts, kinds)],
    )
    return finish_tracks(samples, options)


def _unread(header: Sequence[str], parts: Sequence[str], kinds: Sequence[str]) -> list[str]:
    """Return the columns behind the first three that belong to no part, or are not read of one."""
    read = {f"{part}.{kind}" for part in parts for kind in kinds}
    return [name for name in header[3:] if name and name not in read]
