"""Tracks of SynthEyes, its export "Tracker 2-D Paths".

Lines ``name frame u v``, perhaps with an outcome code. u and v run from -1 at the centre of the
first pixel to 1 at that of the last, right and down. Frames from 0.
"""

from pathlib import Path

import numpy as np

from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, needed_image_size, normalised
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, read_numbers
from usdface.io.takes.track_text import numbered_lines, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_syntheyes"]

# Bits of the outcome code: the tracker is enabled, there is a usable position, it is out of sight.
_ENABLED, _USABLE, _OUT_OF_SIGHT = 2, 4, 32


def read_syntheyes(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the paths; a tracker that is disabled or out of sight in a frame is occluded there.

    Raises
    ------
    InputError
        If the file is missing or no such export, or the size of the image is not given.
    """
    size = needed_image_size(path, options, "-1 to 1")
    by_name: dict[str, list[Row]] = {}
    for number, line in numbered_lines(path):
        cells = line.rsplit(None, 4)
        # Without the outcome code the first of the last four words is no part of the name.
        coded = len(cells) == 5 and "." not in cells[4]
        name, *values = cells if coded else line.rsplit(None, 3)
        by_name.setdefault(name, []).append((number, values))
    table = read_blocks(path, list(by_name.items()), 3)
    rows = [row for rows in by_name.values() for row in rows]
    codes = [(n, values[3:] or [str(_ENABLED | _USABLE)]) for n, values in rows]
    outcome = read_numbers(path, codes, (0,))[:, 0]
    usable = np.isfinite(outcome) & (np.abs(outcome) < 2**31)
    bits = np.where(usable, outcome, 0).astype(np.int64)
    seen = (bits & _ENABLED > 0) & (bits & _USABLE > 0) & (bits & _OUT_OF_SIGHT == 0)
    places = np.where(seen[:, None], table.numbers[:, 1:], np.nan)
    places = normalised(path, places, "SynthEyes (scale 1, offset 0)")
    tracks = ImageTracks(
        path=path,
        table=table,
        places=(places + 1) / 2 * (np.array(size) - 1) + 0.5,
        origin="top",
        first_frame=0,
        image_size=size,
    )
    return finish_tracks(tracks, options)
