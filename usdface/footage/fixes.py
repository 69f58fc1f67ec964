"""Corrections of tracks by the user: from a corrected frame on a marker is followed anew."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError, did_you_mean
from usdface.footage.dots import Dots
from usdface.footage.follow import HIDDEN, follow

__all__ = ["Fix", "apply_fixes"]

# A correction is of the dot within so many of its long half axes, or pixels if that is more.
_AXES, _PIXELS = 1.5, 4.0


@dataclass(frozen=True, slots=True)
class Fix:
    """The corrected place of a marker in a frame (x right, y down [px]); None: occluded there."""

    frame: int
    name: str
    place: tuple[float, float] | None


def apply_fixes(
    frames: Sequence[Dots],
    table: IntArray,
    agreed: BoolArray,
    names: Sequence[str],
    fixes: Sequence[Fix],
) -> tuple[IntArray, BoolArray, tuple[str, ...]]:
    """Return tracks (F, M) with corrections, where they are sure, and corrections without a dot.

    From its frame on to the marker's next correction the marker is followed anew, and back
    to where it was last seen. A dot that another marker had is that marker's no more.

    Parameters
    ----------
    frames : sequence of Dots, length F
    table : (F, M) int64
        Index of each track's dot among those of the frame; HIDDEN = none.
    agreed : (F, M) bool
        Where following forwards and backwards gave the same dot.
    names : sequence of str, length M
    fixes : sequence of Fix

    Raises
    ------
    InputError
        If a correction is of no marker, or of no frame.
    """
    table, agreed = table.copy(), agreed.copy()
    unused = []
    ordered = sorted(fixes, key=lambda fix: fix.frame)
    for number, fix in enumerate(ordered):
        track, frame = _track_of(fix, names), _frame_of(fix, len(frames))
        dot = HIDDEN if fix.place is None else _dot_at(frames[frame], fix.place)
        if fix.place is not None and dot == HIDDEN:
            unused.append(f"{fix.name}, frame {frame}")
            continue
        same = (later.frame for later in ordered[number + 1 :] if later.name == fix.name)
        end = next(same, len(frames))
        if dot == HIDDEN:
            table[frame, track] = HIDDEN
            continue
        _follow_anew(frames, table, track, dot, range(frame, end))
        seen = np.flatnonzero(table[:frame, track] >= 0)
        begin = int(seen[-1]) + 1 if len(seen) else 0
        _follow_anew(frames, table, track, dot, range(frame, begin - 1, -1))
        agreed[begin:end, track] = True
    return table, agreed, tuple(unused)


def _track_of(fix: Fix, names: Sequence[str]) -> int:
    if fix.name not in names:
        raise InputError(
            f"a correction is of the marker {fix.name!r}, which the film does not have"
            f"{did_you_mean(fix.name, names)}",
            "MARKER_UNKNOWN",
        )
    return list(names).index(fix.name)


def _frame_of(fix: Fix, count: int) -> int:
    if not 0 <= fix.frame < count:
        raise InputError(
            f"a correction is of frame {fix.frame}; the film has the frames 0 to {count - 1}",
            "FRAMES_OUTSIDE",
        )
    return fix.frame


def _dot_at(dots: Dots, place: tuple[float, float]) -> int:
    """Return the dot at a place, or HIDDEN."""
    if not len(dots):
        return HIDDEN
    away = np.linalg.norm(dots.centres - place, axis=1)
    nearest = int(np.argmin(away))
    reach = max(_PIXELS, _AXES * float(dots.axes[nearest, 0]))
    return nearest if away[nearest] <= reach else HIDDEN


def _follow_anew(
    frames: Sequence[Dots], table: IntArray, track: int, dot: int, order: range
) -> None:
    """Follow one track, beside all others, through some frames of the table, in their order."""
    if not len(order):
        return
    start = table[order[0]].copy()
    start[start == dot] = HIDDEN
    start[track] = dot
    places = _expected(frames, table, order)
    new = follow([frames[k] for k in order], start, places, births=False).dots
    for frame, row in zip(order, new, strict=True):
        table[frame, track] = row[track]
        robbed = (table[frame] == row[track]) & (row[track] >= 0)
        robbed[track] = False
        table[frame, robbed] = np.where(row[robbed] == row[track], HIDDEN, row[robbed])


def _expected(frames: Sequence[Dots], table: IntArray, order: range) -> FloatArray:
    """Return the place (M, 2) of each track where it is next seen, of those occluded at first."""
    places = np.full((table.shape[1], 2), -1e6)
    for frame in reversed(order):
        seen = table[frame] >= 0
        places[seen] = frames[frame].centres[table[frame, seen]]
    return places
