"""Points of DeepLabCut as CSV.

Rows of a header: ``scorer``, perhaps ``individuals``, ``bodyparts``, ``coords``, then a row for
each frame: its index, and x, y, likelihood of each part. Pixels, the centre of the top left one
is (0, 0).
"""

from collections.abc import Sequence
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import read_table
from usdface.io.takes.wide_tracks import samples_of_columns
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_deeplabcut"]

_HEADER = ("scorer", "individuals", "bodyparts", "coords")
_THRESHOLD = 0.6  # DeepLabCut's own for plots and videos, `pcutoff`


def read_deeplabcut(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake, list[Finding]]:
    """Read the points; their likelihood is the confidence.

    Raises
    ------
    InputError
        If the file is missing or no such table.
    """
    rows = read_table(path)
    header = _header(path, rows)
    columns = _columns_of_parts(path, header)
    scored = all("likelihood" in kinds for kinds in columns.values())
    wanted = ("x", "y", "likelihood") if scored else ("x", "y")
    points = [(label, [kinds[kind] for kind in wanted]) for label, kinds in columns.items()]
    if not points:
        raise InputError(
            f"{path}: there are no body parts; expected columns x, y of one at least", "TAKE_EMPTY"
        )
    table = samples_of_columns(path, rows[len(header) :], 0, points)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:3] + 0.5,
        origin="top",
        first_frame=0,
        image_size=image_size(path, options),
        confidence=table.numbers[:, 3] if scored else None,
        threshold=_THRESHOLD,
        ignored=sorted({kind for kinds in columns.values() for kind in kinds} - {*wanted}),
    )
    return finish_tracks(tracks, options)


def _header(path: Path, rows: Sequence[tuple[int, list[str]]]) -> dict[str, list[str]]:
    """Return the rows of the header by their names."""
    header: dict[str, list[str]] = {}
    while len(header) < len(rows) and rows[len(header)][1][0].lower() in _HEADER:
        name = rows[len(header)][1][0].lower()
        if name in header:
            raise InputError(
                f"{path}: the row {name} occurs twice; expected it once, as DeepLabCut writes it",
                "COLUMNS_WRONG",
            )
        header[name] = rows[len(header)][1]
    missing = [name for name in ("scorer", "bodyparts", "coords") if name not in header]
    if missing:
        raise InputError(
            f"{path}: the header has no row {missing[0]}; expected scorer, bodyparts and coords",
            "COLUMNS_WRONG",
        )
    return header


def _columns_of_parts(path: Path, header: dict[str, list[str]]) -> dict[str, dict[str, int]]:
    """Return the columns of each body part, by x, y and likelihood."""
    columns: dict[str, dict[str, int]] = {}
    for column, kind in enumerate(header["coords"][1:], 1):
        names = [
            header[row][column : column + 1]
            for row in ("individuals", "bodyparts")
            if row in header
        ]
        label = ":".join(name[0] for name in names if name and name[0])
        columns.setdefault(label, {})[kind.lower()] = column
    for label, kinds in columns.items():
        if not {"x", "y"} <= kinds.keys():
            raise InputError(
                f"{path}: {label[:40]!r} has no column x or y; "
                "expected both, as DeepLabCut writes them",
                "COLUMNS_WRONG",
            )
    return columns
