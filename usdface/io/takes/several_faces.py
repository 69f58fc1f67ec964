"""The face that is read of several that a tracker saw: the one that is seen in most frames.

A passer-by is seen for a moment, a performer throughout. Where a program numbers faces, its numbers
count; a face that was lost and found again at its place, under another number, is one face where
the program gives a new number to each face that it finds. Where it only lists those of a frame, in
any order, each is followed by its place.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import chain, pairwise
from math import inf, isfinite, nan
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.takes.text_table import Row
from usdface.plain_text import listed

__all__ = ["faces_left_out", "follow_faces", "rows_of_face"]

_Sample = tuple[str, str | int]  # number of a face, and of a frame
_LISTED = 8  # faces that the finding names
_REMEMBERED = 64  # people that a face is compared with; a film of noise has no end of them
# Of a face before it was lost and after it was found again: how far its centre may have moved, as a
# share of its size, and how many times as large one may be as the other. Set by hand: heads of two
# people are a whole size apart.
_MOVED, _GROWN = 0.5, 1.3
_FARTHEST = 1e6  # px; more is no place that counts
# In the column of the face's number where no face was found.
_NOBODY = frozenset({"", "-1", "-1.0", "nan", "na", "none", "null"})
_JOINED = (
    "{face} was lost and is found again near its place under other numbers, which are read as the "
    "same person: {names}"
)


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
    path: Path,
    rows: list[Row],
    column: int | None,
    frame: int,
    seen: Callable[[list[str]], bool],
    points: Callable[[list[str]], FloatArray] | None = None,
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
    points : callable, optional
        Returns the landmarks (N, 2) in the cells of a row. Faces that are never seen together are
        one where each is found near the place and of the size that the other had when it was lost;
        FACES_JOINED names them. Without it each number is a face.
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
        each: cells
        for each, (_, cells) in zip(whose, rows, strict=True)
        if each[0] in numbers and seen(cells)
    }
    people = _people(tracked, points) if points else {}
    found = Counter(people.get(face, face) for face, _ in tracked)
    counts = {face: found[face] for face in numbers if found[face]} or numbers
    face = max(counts, key=counts.__getitem__)
    again = [name for name, person in people.items() if person == face and name != face]
    mine = _rows_of({face, *again}, rows, whose, column, tracked)
    findings = []
    if again:
        names = [f"face {name}" for name in again]
        findings = [finding("FACES_JOINED", str(path), _JOINED, f"face {face}", names)]
    if len(counts) < 2:
        return mine, findings
    shown = {place for name, place in tracked if name in (face, *again)}
    together = {people.get(name, name) for name, place in tracked if place in shown}
    apart = [f"face {name}" for name, count in counts.items() if count and name not in together]
    named = {f"face {name}": count for name, count in counts.items()}
    return mine, [*findings, faces_left_out(path, f"face {face}", named, apart)]


def _rows_of(
    same: Collection[str],
    rows: list[Row],
    whose: Sequence[_Sample],
    column: int,
    tracked: Collection[_Sample],
) -> list[Row]:
    """Return the rows of a face; of other frames those of one that is never seen, and cut ones.

    Of the numbers `same` that the face has, a frame's is that by which it is seen there.
    """
    seen = {name for name, _ in tracked}
    owners = {frame: name for name, frame in tracked if name in same}
    for name, frame in whose:
        if name in same:
            owners.setdefault(frame, name)
    for name, frame in whose:
        if name not in seen:
            owners.setdefault(frame, name)
    return [
        row
        for row, (name, frame) in zip(rows, whose, strict=True)
        if owners.get(frame) == name or len(row[1]) <= column
    ]


def _people(
    tracked: Mapping[_Sample, list[str]], points: Callable[[list[str]], FloatArray]
) -> dict[str, str]:
    """Return who each face is, by the number under which that person is first seen.

    Of very many faces only those of most frames are compared.
    """
    seen: dict[str, dict[float, list[str]]] = {}
    for (name, frame), cells in tracked.items():
        seen.setdefault(name, {})[_number(frame)] = cells
    people: dict[str, str] = {name: name for name in seen}
    if not all(map(isfinite, chain.from_iterable(seen.values()))):
        return people
    longest = sorted(seen, key=lambda each: -len(seen[each]))[:_REMEMBERED]
    for name in sorted(longest, key=lambda each: min(seen[each])):
        others = {
            person: moved
            for person in dict.fromkeys(people[each] for each in longest if each != name)
            if min(seen[person]) < min(seen[name])
            and (moved := _moved(seen[person], seen[name], points)) <= _MOVED
        }
        if others:
            person = min(others, key=others.__getitem__)
            people[name] = person
            seen[person] |= seen[name]
    return people


def _moved(
    one: Mapping[float, list[str]],
    other: Mapping[float, list[str]],
    points: Callable[[list[str]], FloatArray],
) -> float:
    """Return how far a face moves from one number to the other, in its size; inf = another face.

    `one` and `other` have the cells of the frames in which each is seen.
    """
    if one.keys() & other.keys():
        return inf
    farthest = 0.0
    for before, after in pairwise(sorted([*one, *other])):
        if (before in one) != (after in one):
            places = [points((one if at in one else other)[at]) for at in (before, after)]
            if not all((np.abs(each) < _FARTHEST).all() for each in places):
                return inf
            small, large = sorted(float(np.ptp(each, axis=0).max()) for each in places)
            if not 0.0 < small >= large / _GROWN:
                return inf
            away = float(np.linalg.norm(places[0].mean(axis=0) - places[1].mean(axis=0)))
            farthest = max(farthest, away / small)
    return farthest


def _number(frame: str | int) -> float:
    """Return the number of a frame; NaN where the cell has none."""
    try:
        return float(frame)
    except ValueError:
        return nan


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
