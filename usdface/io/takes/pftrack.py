"""Tracks of PFTrack and PFMatchit (.2dt).

For each track its name in quotes, from version 5 on the camera's name or the clip's number, the
number of samples, and lines ``frame x y residual``, perhaps with a depth. Pixels, the centre of the
bottom left one is (0, 0).
"""

from collections.abc import Sequence
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.track_text import (
    Block,
    Line,
    cut_off,
    numbered_lines,
    read_blocks,
    whole_number,
)
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_pftrack"]


def read_pftrack(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the tracks of the first camera.

    Raises
    ------
    InputError
        If the file is missing, no such export, or ends early.
    """
    by_camera = _by_camera(path, numbered_lines(path, comment="#"))
    cameras = list(by_camera)
    table = read_blocks(path, by_camera[cameras[0]] if cameras else (), 3)
    # PFTrack counts frames from 0, PFMatchit, which numbers clips, from 1.
    tracks = ImageTracks(
        path=path,
        table=table,
        places=table.numbers[:, 1:] + 0.5,
        origin="bottom",
        first_frame=int(cameras[0].isdecimal()),
        image_size=image_size(path, options),
        ignored=("residual",),
    )
    take, findings = finish_tracks(tracks, options)
    if cameras[1:]:
        message = "a take is of one camera; not read: tracks of {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, cameras[1:]))
    return take, findings


def _by_camera(path: Path, lines: Sequence[Line]) -> dict[str, list[Block]]:
    """Return the tracks of each camera; one "" if cameras are not named."""
    # All tracks are written as the first one is: name, perhaps a camera or clip, count, samples.
    named = len(lines) > 1 and _quoted(lines[1]) is not None
    numbered = not named and len(lines) > 2 and lines[2][1].isdecimal()
    found: dict[str, list[Block]] = {}
    at, label = 0, ""
    while at < len(lines):
        # The second camera of a track follows the first without the name.
        follows = named or (numbered and lines[at][1].isdecimal())
        again = label and follows and at + 1 < len(lines) and _quoted(lines[at + 1]) is None
        if not again:
            label = _quoted(lines[at]) or ""
            if not label:
                raise InputError(
                    f"{path}, line {lines[at][0]}: {lines[at][1][:40]!r}; "
                    "expected the name of a track in quotes",
                    "ROW_WRONG",
                )
            at += 1
        camera = lines[at][1] if (named or numbered) and at < len(lines) else ""
        at += bool(camera)
        if at >= len(lines):
            raise cut_off(path, label, 1, 0)
        length = whole_number(path, lines[at], f"the samples of track {label[:40]!r}")
        samples = lines[at + 1 : at + 1 + length]
        if len(samples) < length:
            raise cut_off(path, label, length, len(samples))
        rows = [(number, text.split()) for number, text in samples]
        found.setdefault(camera, []).append((label, rows))
        at += 1 + length
    return found


def _quoted(line: Line) -> str | None:
    text = line[1]
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else None
