"""Tracks in the .uv files of mmSolver: lines of text (version 1) or JSON (2 to 5).

Coordinates run from 0 to 1 of the image's width and height, from the bottom left corner. The JSON
may hold each place as it was seen (``pos_dist``) and without the distortion of the lens
(``pos``), and from version 4 on the size of the image.
"""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, needed_image_size, normalised
from usdface.io.takes.json_text import number, read_json
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import read_text
from usdface.io.takes.track_text import TrackTable, announced_blocks, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_mmsolver"]

_VERSIONS = (2, 3, 4, 5)
_LEAST_WEIGHT = 1e-6  # above zero, which says that a sample is not to be used


def read_mmsolver(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the points; places without distortion if there are any, weights as confidence.

    Raises
    ------
    InputError
        If the file is missing or no such file, or the size of the image is not known.
    """
    width = height = focal = 0.0
    unread: list[str] = []
    if read_text(path).lstrip()[:1] == "{":
        document = read_json(path)
        table = _of_json(path, document)
        unread = _unread(document)
        camera = document.get("camera")
        resolution = camera.get("resolution") if isinstance(camera, dict) else None
        if isinstance(resolution, list) and len(resolution) == 2:
            width, height = np.nan_to_num([number(side) for side in resolution])
            focal = _focal_length(camera, width)
    else:
        table = _of_lines(path)
    size = needed_image_size(path, options, "0 to 1", width, height)
    tracks = ImageTracks(
        path=path,
        table=table,
        places=np.asarray(normalised(path, table.numbers[:, 1:3], "mmSolver") * size),
        origin="bottom",
        first_frame=1,
        image_size=size,
        focal_length=focal if not options.image_size else 0.0,
        confidence=np.nan_to_num(table.numbers[:, 3], nan=1.0),
        threshold=_LEAST_WEIGHT,
        ignored=unread,
    )
    return finish_tracks(tracks, options)


def _unread(document: dict[str, Any]) -> list[str]:
    """Return the contents of points, samples and document that are not read."""
    points = document["points"]
    samples = [each for point in points for each in point.get("per_frame") or ()]
    placed = any(isinstance(sample.get("pos"), list) for sample in samples)
    read = {"version", "num_points", "points", "camera"}
    read |= {"name", "id", "per_frame", "frame", "pos", "weight", *(() if placed else ["pos_dist"])}
    keys = {key: None for part in (document, *points, *samples) for key in part}
    camera = document.get("camera")
    frames = camera.get("per_frame") if isinstance(camera, dict) else None
    lengths = {str(f.get("focal_length_cm")) for f in frames or () if isinstance(f, dict)}
    changing = ["a focal length that changes"] if len(lengths) > 1 else []
    return [str(key) for key in keys if key not in read] + changing


def _focal_length(camera: dict[str, Any], width: float) -> float:
    """Return the focal length [px]; 0 where it changes, or is not known."""
    back, frames = camera.get("film_back_cm"), camera.get("per_frame")
    across = number(back[0]) if isinstance(back, list) and back else np.nan
    samples = frames if isinstance(frames, list) else []
    lengths = {number(f.get("focal_length_cm")) for f in samples if isinstance(f, dict)}
    if len(lengths) != 1 or not across > 0:
        return 0.0
    focal = lengths.pop() / across * width
    return float(focal) if 0 < focal < np.inf else 0.0


def _of_lines(path: Path) -> TrackTable:
    return read_blocks(path, announced_blocks(path), 4)


def _of_json(path: Path, document: Any) -> TrackTable:
    version = document.get("version") if isinstance(document, dict) else None
    if version not in _VERSIONS:
        raise InputError(f"{path}: version {str(version)[:20]!r}; expected 2 to 5", "SCHEMA_BROKEN")
    points = document.get("points")
    if not isinstance(points, list) or not all(isinstance(point, dict) for point in points):
        raise InputError(f"{path}: expected a list of points", "SCHEMA_BROKEN")
    labels, tracks, values = [], [], []
    for index, point in enumerate(points):
        labels.append(str(point.get("name") or ""))
        samples = point.get("per_frame")
        for sample in samples if isinstance(samples, list) else ():
            if not isinstance(sample, dict):
                raise InputError(
                    f"{path}: point {labels[-1][:40]!r} has no samples; "
                    'expected a list of objects "per_frame"',
                    "SCHEMA_BROKEN",
                )
            place = sample.get("pos")
            if not isinstance(place, list):
                place = sample.get("pos_dist")
            u, v = place if isinstance(place, list) and len(place) == 2 else (None, None)
            weight = sample.get("weight", 1.0)
            values.append([number(each) for each in (sample.get("frame"), u, v, weight)])
            tracks.append(index)
    if not labels:
        raise InputError(f"{path}: there are no points; expected at least one", "TAKE_EMPTY")
    numbers = np.array(values).reshape(-1, 4)
    return TrackTable(tuple(labels), np.array(tracks, dtype=np.int64), numbers, ())
