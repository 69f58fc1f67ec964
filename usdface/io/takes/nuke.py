"""Tracks in scripts of Nuke (.nk): the nodes Tracker3 and Tracker4.

A script is text in Tcl's syntax; it is split into words and braces here, and nothing in it is
evaluated. Of a Tracker3 node ``track1`` to ``track4`` hold a curve of x and one of y, of a Tracker4
node a table ``tracks`` with a row for each track, whose columns its header names. Pixels from the
bottom left corner.

A curve is a list of values; ``x5`` says that the next one is of frame 5. A value without such a
word follows the one before by the step of the last two; other words are about slopes.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.image_tracks import ImageTracks, finish_tracks, image_size
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.text_table import Row, positive, read_text
from usdface.io.takes.track_text import Block, read_blocks
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_nuke"]

Words: TypeAlias = list[Any]  # words and lists of them

_WORD = re.compile(r'[{}]|"(?:[^"\\]|\\.)*"|(?:[^\s{}\\]|\\.)+', re.DOTALL)
_FRAME = re.compile(r"x(-?[0-9]+(?:\.[0-9]*)?)")
_WHOLE = re.compile(r"-?[0-9]{1,9}")
_DEEPEST = 64
_POINTS = ("track1", "track2", "track3", "track4")


def read_nuke(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the tracks of all tracker nodes; only frames with keys are samples.

    Raises
    ------
    InputError
        If the file is missing, its braces do not match, or it has no such track.
    """
    script = _parsed(path, read_text(path))
    blocks: list[Block] = []
    skipped: list[str] = []
    size, rate, first, sized_by_root = (0.0, 0.0, 1.0), 0.0, 1, False
    for kind, node in _nodes(script):
        if "format" in node and not sized_by_root:
            size = _format(node["format"]) or size
            sized_by_root = kind == "Root" and bool(size[0])
        if kind == "Root":
            rate = positive(str(node.get("fps", "")))
            first = _first_frame(node.get("first_frame"))
        elif kind == "Tracker3":
            found = [(each, _curves(node[each])) for each in _POINTS if each in node]
            animated = [(point, curves) for point, curves in found if curves]
            name = str(node.get("name", "Tracker"))
            for point, (x, y) in animated:
                label = name if len(animated) == 1 else f"{name} {point}"
                blocks.append((label, _samples(x, y)))
        elif kind == "Tracker4":
            for label, curves in _table(node):
                if curves:
                    blocks.append((label, _samples(*curves)))
                else:
                    skipped.append(label)
    if not blocks:
        raise InputError(
            f"{path}: there is no animated track in a node Tracker3 or Tracker4; "
            "track in one of them and save the script",
            "TAKE_EMPTY",
        )
    table = read_blocks(path, blocks, 3)
    shown = image_size(path, options, *size)
    tracks = ImageTracks(
        path=path,
        table=replace(table, lines=()),
        places=table.numbers[:, 1:] * np.array([size[2], 1.0]),
        origin="bottom",
        first_frame=first,
        image_size=shown,
        rate=rate,
        ignored=("offsets", "errors", "pattern and search areas"),
    )
    take, findings = finish_tracks(tracks, options)
    if skipped:
        message = "without keys of their own, not read: {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, skipped))
    return take, findings


def _parsed(path: Path, text: str) -> Words:
    """Return the words of a script; text in braces is a list."""
    top: Words = []
    stack = [top]
    for match in _WORD.finditer(text):
        word = match[0]
        if word == "{":
            if len(stack) > _DEEPEST:
                raise InputError(
                    f"{path}: more than {_DEEPEST} braces in braces; "
                    "expected a script as Nuke saves it",
                    "SCHEMA_BROKEN",
                )
            inner: Words = []
            stack[-1].append(inner)
            stack.append(inner)
        elif word == "}":
            if len(stack) == 1:
                raise InputError(
                    f"{path}: a brace closes that was not opened; "
                    "expected a script as Nuke saves it",
                    "SCHEMA_BROKEN",
                )
            stack.pop()
        else:
            stack[-1].append(word[1:-1] if len(word) > 1 and word[0] == word[-1] == '"' else word)
    if len(stack) > 1:
        raise InputError(
            f"{path}: {len(stack) - 1} braces do not close; export or copy it again", "FILE_CUT_OFF"
        )
    return top


def _nodes(script: Words) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield class and knobs of each node, those of groups likewise."""
    for kind, body in pairwise(script):
        if not isinstance(kind, str) or not isinstance(body, list):
            continue
        if kind in ("Root", "Tracker3", "Tracker4") or "format" in body:
            yield kind, {k: v for k, v in pairwise(body) if isinstance(k, str)}


def _first_frame(value: Any) -> int:
    """Return the frame that a script begins at, which may be 0 or less; 1 if it does not say."""
    text = str(value)
    return int(text) if _WHOLE.fullmatch(text) else 1


def _format(value: Any) -> tuple[float, float, float] | None:
    """Return width, height [px] and pixel aspect of a format; None if it is none."""
    numbers = [positive(word) for word in str(value).split()[:7]]
    if len(numbers) < 2 or not (numbers[0] and numbers[1]):
        return None
    aspect = numbers[6] if len(numbers) == 7 and 0.01 < numbers[6] < 100 else 1.0
    return numbers[0], numbers[1], aspect


def _curves(value: Any) -> tuple[Words, Words] | None:
    """Return the curves of x and y of a knob ``{{curve ...} {curve ...}}``."""
    if isinstance(value, list) and len(value) == 2 and all(map(_is_curve, value)):
        return value[0], value[1]
    return None


def _is_curve(value: Any) -> bool:
    # Some versions of Nuke write {"curve " x1 ...}.
    named = isinstance(value, list) and len(value) > 1 and isinstance(value[0], str)
    return named and value[0].strip() == "curve"


def _table(node: dict[str, Any]) -> Iterator[tuple[str, tuple[Words, Words] | None]]:
    """Yield label and curves of each row of a Tracker4 node."""
    tracks = node.get("tracks")
    if not (isinstance(tracks, list) and len(tracks) >= 3):
        return
    header, rows = tracks[1], tracks[2]
    if not (isinstance(header, list) and isinstance(rows, list)):
        return
    columns = [each[4] if isinstance(each, list) and len(each) > 4 else "" for each in header]
    wanted = ["name", "track_x", "track_y"]
    if not all(column in columns for column in wanted):
        return
    name, x, y = map(columns.index, wanted)
    for row in rows:
        if isinstance(row, list) and len(row) > max(name, x, y):
            label = f"{node.get('name', 'Tracker')}:{row[name]}"
            yield label, _curves([row[x], row[y]])


def _samples(x: Words, y: Words) -> list[Row]:
    """Return the frames in which both curves have a key."""
    xs, ys = _keys(x), _keys(y)
    return [(0, [frame, xs[frame], ys[frame]]) for frame in xs if frame in ys]


def _keys(curve: Words) -> dict[str, str]:
    """Return frame -> value of a curve, as text."""
    keys: dict[str, str] = {}
    frame, step, given = 0.0, 1.0, True
    last: float | None = None
    for word in curve[1:]:
        if not isinstance(word, str):
            continue
        if at := _FRAME.fullmatch(word):
            frame, given = float(at[1]), True
            continue
        try:
            float(word)
        except ValueError:
            continue  # interpolation, slopes, expressions
        if not given and last is not None:
            frame = last + step
        if last is not None and frame > last:
            step = frame - last
        keys[repr(frame)] = word
        last, given = frame, False
    return keys
