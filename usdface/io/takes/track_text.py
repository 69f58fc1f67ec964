"""Samples of tracks in text files: lines, blocks of lines for each track, tables of numbers."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.io.takes.text_table import Row, read_numbers, read_text

__all__ = [
    "Block",
    "Line",
    "TrackTable",
    "announced_blocks",
    "cut_off",
    "numbered_lines",
    "read_blocks",
    "whole_number",
]

Line: TypeAlias = tuple[int, str]  # line number from 1, text without outer blanks
Block: TypeAlias = tuple[str, Sequence[Row]]  # label of a track, a row for each sample

_WHOLE = re.compile(r"[+-]?[0-9]{1,9}")


@dataclass(frozen=True, eq=False, slots=True)
class TrackTable:
    """Samples of tracks, as numbers in the order of the file.

    Attributes
    ----------
    labels : tuple of str, length M
    tracks : (N,) int
        Index of the track of each sample.
    numbers : (N, C) float64
        Frame numbers, then columns as the reader names them; NaN where nothing is written.
    lines : sequence of int, length N or 0
        Line number of each, for messages; none = unknown.
    """

    labels: tuple[str, ...]
    tracks: IntArray
    numbers: FloatArray
    lines: Sequence[int]

    @property
    def frames(self) -> FloatArray:
        """The frame number of each sample, as in the file: (N,)."""
        return self.numbers[:, 0]


def read_blocks(path: Path, blocks: Sequence[Block], width: int) -> TrackTable:
    """Return the first `width` cells of every row as numbers.

    Raises
    ------
    InputError
        If there is no track, a row has too few cells, or one is no number.
    """
    if not blocks:
        raise InputError(f"{path}: there are no tracks; expected at least one", "TAKE_EMPTY")
    rows = [row for _, rows in blocks for row in rows]
    for line, cells in rows:
        if len(cells) < width:
            raise InputError(
                f"{path}, line {line}: {len(cells)} values; expected {width} or more", "ROW_WRONG"
            )
    counts = [len(rows) for _, rows in blocks]
    return TrackTable(
        tuple(label for label, _ in blocks),
        np.repeat(np.arange(len(blocks)), counts),
        read_numbers(path, rows, range(width)),
        [line for line, _ in rows],
    )


def numbered_lines(path: Path, comment: str = "") -> list[Line]:
    """Return the lines in which something is written, without those that begin a comment.

    Raises
    ------
    InputError
        If the file is missing, unreadable, empty or not text.
    """
    text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
    lines = [(n, line.strip()) for n, line in enumerate(text.split("\n"), 1)]
    return [(n, line) for n, line in lines if line and not (comment and line.startswith(comment))]


def whole_number(path: Path, line: Line, subject: str) -> int:
    """Return the number, 0 or more, that a line consists of.

    Raises
    ------
    InputError
        If it consists of anything else.
    """
    number, text = line
    if not _WHOLE.fullmatch(text) or int(text) < 0:
        raise InputError(
            f"{path}, line {number}: {text[:40]!r}; expected {subject}, a whole number", "ROW_WRONG"
        )
    return int(text)


def cut_off(path: Path, label: str, expected: int, found: int) -> InputError:
    """Return the error for a file that ends within a track."""
    return InputError(
        f"{path}: the file ends within track {label[:40]!r}: "
        f"{found} of {expected} samples are there; export it again",
        "FILE_CUT_OFF",
    )


def announced_blocks(path: Path, also: Sequence[str] = ()) -> list[Block]:
    """Read a count of points, then for each its label, its number of samples, and these.

    `also` names whole numbers that stand between label and number of samples.

    Raises
    ------
    InputError
        If the file is missing, ends early, or holds more than it announces.
    """
    lines = numbered_lines(path)
    count, at, head = whole_number(path, lines[0], "the number of points"), 1, 2 + len(also)
    blocks: list[Block] = []
    while len(blocks) < count:
        if at + head > len(lines):
            raise InputError(
                f"{path}: {count} points are announced, {len(blocks)} are there; export it again",
                "FILE_CUT_OFF",
            )
        label = lines[at][1]
        for place, name in enumerate(also, at + 1):
            whole_number(path, lines[place], f"the {name} of point {label[:40]!r}")
        length = whole_number(path, lines[at + head - 1], f"the samples of point {label[:40]!r}")
        samples = lines[at + head : at + head + length]
        if len(samples) < length:
            raise cut_off(path, label, length, len(samples))
        blocks.append((label, [(number, text.split()) for number, text in samples]))
        at += head + length
    if at < len(lines):
        raise InputError(
            f"{path}, line {lines[at][0]}: text after the {count} points that are announced; "
            "correct the number or delete the rest",
            "ROW_WRONG",
        )
    return blocks
