"""Tracks as Shake writes them as text, and Nuke's CameraTracker after it.

``TrackName`` and the name, a line ``Frame X Y Correlation``, then a line for each sample. Pixels
from the bottom left corner, frames from 1.
"""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row
from usdface.io.takes.track_text import numbered_lines, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_shake"]


def read_shake(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the tracks; the correlation is the confidence of a sample.

    Raises
    ------
    InputError
        If the file is missing or no such export.
    """
    blocks: list[tuple[str, list[Row]]] = []
    for number, line in numbered_lines(path):
        words = line.split()
        first = words[0].lower()
        if first == "trackname":
            blocks.append((line[len(words[0]) :].strip(), []))
        elif not blocks:
            raise InputError(
                f"{path}, line {number}: {line[:40]!r}; expected TrackName and a name", "ROW_WRONG"
            )
        elif first != "frame":
            blocks[-1][1].append((number, words))
    table = read_blocks(path, blocks, 4)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:3],
        origin="bottom",
        first_frame=1,
        image_size=image_size(path, options),
        confidence=table.numbers[:, 3],
    )
    return finish_tracks(tracks, options)
