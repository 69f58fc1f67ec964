"""The face that is read of several that a tracker saw: the one that is seen in most frames.

A passer-by is seen for a moment, a performer throughout. Where a program numbers faces, its numbers
count. Where it only lists those of a frame, in any order, each is followed by its place.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.takes.text_table import Row
from usdface.plain_text import listed

__all__ = ["faces_left_out", "follow_faces", "rows_of_face"]

_LISTED = 8  # faces that the finding names
_REMEMBERED = 64  # people that a face is compared with; a film of noise has no end of them
# In the column of the face's number where no face was found.
_NOBODY = frozenset({"", "-1", "-1.0", "nan", "na", "none", "null"})


def faces_left_out(
    path: Path, face: str, counts: Mapping[str, int], apart: Sequence[str] = ()
) -> Finding:
    """Report the faces that are not read.

    Parameters
    ----------
    path : Path
    face : str
        The one that is read.
    counts : dict of str to int
        In how many frames each is seen.
    apart : sequence of str
        Those of the others that are seen in no frame of it, and may be the same person.
    """
    others = {name: count for name, count in counts.items() if name != face}
    detail = listed([f"{name} ({count})" for name, count in others.items()], _LISTED)
    advice = "leave only the performer's samples in the file"
    if apart:
        advice += (
            f"; if {listed(apart, _LISTED)} is the same person, found again, give both one number"
        )
    message = (
        "of {face_count} faces that of most frames is read: {face} ({frame_count} frames); "
        "left out: {detail}; {advice}"
    )
    values = len(counts), face, counts[face], Prose(detail), Prose(advice)
    return finding("FACES_LEFT_OUT", str(path), message, *values)


def rows_of_face(
    path: Path, rows: list[Row], column: int | None, frame: int, seen: Callable[[list[str]], bool]
) -> tuple[list[Row], list[Finding]]:
    """Return the rows of the face that is seen in most frames, and those in which no face is.

    Parameters
    ----------
    path : Path
    rows : list
        Those with data, of all faces.
    column : int or None
        Of the face's number; None = there is none.
    frame : int
        Column of the frame's number; -1 = each row is a frame.
    seen : callable
        Whether the cells of a row show that its face is seen.
    """
    if column is None:
        return rows, []
    whose = [
        (_cell(cells, column), _cell(cells, frame) if frame >= 0 else number)
        for number, (_, cells) in enumerate(rows)
    ]
    numbers = {face: 0 for face, _ in whose if face.lower() not in _NOBODY}
    if len(numbers) < 2:
        return rows, []
    tracked = {
        each
        for each, (_, cells) in zip(whose, rows, strict=True)
        if each[0] in numbers and seen(cells)
    }
    found = Counter(face for face, _ in tracked)
    counts = {face: found[face] for face in numbers if found[face]} or numbers
    face = max(counts, key=counts.__getitem__)
    mine = _rows_of(face, rows, whose, column, counts)
    if len(counts) < 2:
        return mine, []
    shown = {place for name, place in tracked if name == face}
    together = {name for name, place in tracked if place in shown}
    apart = [f"face {name}" for name, count in counts.items() if count and name not in together]
    named = {f"face {name}": count for name, count in counts.items()}
    return mine, [faces_left_out(path, f"face {face}", named, apart)]


def _rows_of(
    face: str,
    rows: list[Row],
    whose: Sequence[tuple[str, str | int]],
    column: int,
    counts: Mapping[str, int],
) -> list[Row]:
    """Return the rows of a face; of other frames those of one that is never seen, and cut ones."""
    own = {frame for name, frame in whose if name == face}
    spare: dict[str | int, str] = {}
    for name, frame in whose:
        if name not in counts and frame not in own:
            spare.setdefault(frame, name)
    return [
        row
        for row, (name, frame) in zip(rows, whose, strict=True)
        if name == face or spare.get(frame) == name or len(row[1]) <= column
    ]


def _cell(cells: Sequence[str], column: int) -> str:
    return cells[column] if column < len(cells) else ""


def follow_faces(
    frames: Sequence[Sequence[FloatArray]], sizes: Sequence[Sequence[float]]
) -> list[list[int]]:
    """Return who each face of each frame is: who was last seen nearest to it, within its size.

    Parameters
    ----------
    frames : sequence of sequence of (2,) float
        Place of each face in each frame, in any unit.
    sizes : sequence of sequence of float
        Of these faces, likewise. No face moves so far from one frame to the next.

    Returns
    -------
    list of list of int
        Numbers of persons, from 0 in the order in which they appear.
    """
    from scipy.optimize import linear_sum_assignment  # costs more to import than most takes need

    last: dict[int, FloatArray] = {}  # where a person was last seen; the latest at the end
    people: list[list[int]] = []
    count = 0
    for places, limits in zip(frames, sizes, strict=True):
        mine = [-1] * len(places)
        if last and places:
            known = list(last)
            away = np.linalg.norm(np.array(places)[:, None] - list(last.values()), axis=2)
            far = away > np.array(limits)[:, None]
            beyond = 1.0 + 2.0 * float(away.max()) * len(places)  # more than all near ones
            nearest = linear_sum_assignment(np.where(far, beyond, away))
            for face, person in zip(*nearest, strict=True):
                mine[face] = -1 if far[face, person] else known[person]
        for face, place in enumerate(places):
            if mine[face] < 0:
                mine[face], count = count, count + 1
            last.pop(mine[face], None)
            last[mine[face]] = place
        while len(last) > max(_REMEMBERED, len(places)):
            del last[next(iter(last))]
        people.append(mine)
    return people
