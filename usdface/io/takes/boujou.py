"""Feature tracks of boujou as text.

Comments, the last of which names the columns, then lines ``track_id view x y``. Pixels from the top
left corner, frames from 0. Writers and readers of the format differ by up to one pixel about the
corner; it is taken as (0, 0) here.
"""

from pathlib import Path

from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row
from usdface.io.takes.track_text import numbered_lines, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_boujou"]


def read_boujou(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the tracks.

    Raises
    ------
    InputError
        If the file is missing or no such export.
    """
    by_name: dict[str, list[Row]] = {}
    for number, line in numbered_lines(path, comment="#"):
        name, *values = line.rsplit(None, 3)
        by_name.setdefault(name, []).append((number, values))
    table = read_blocks(path, list(by_name.items()), 3)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:],
        origin="top",
        first_frame=0,
        image_size=image_size(path, options),
    )
    return finish_tracks(tracks, options)
