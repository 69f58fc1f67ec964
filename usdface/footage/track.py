"""Tracks of a film from the dots of its images: followed both ways, joined, doubted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.footage.choose_channel import LEAST_DOTS, MOST_DOTS
from usdface.footage.dots import Dots
from usdface.footage.face_names import BoundVertices
from usdface.footage.finished_tracks import finished_tracks
from usdface.footage.fixes import Fix, apply_fixes
from usdface.footage.follow import HIDDEN, follow, nearest_distances
from usdface.footage.join_tracks import join_tracks, without_lone_samples
from usdface.footage.labels import DotName, name_tracks
from usdface.footage.tracks import Tracks

__all__ = ["reference_frame", "track_dots"]

# A track is a marker if it is seen in so many frames, and in this share of all.
_LEAST_FRAMES, _LEAST_SHARE = 3, 0.2
# Tracks begin at dots of this fill and roundness (seen at 80 degrees) in the reference frame.
_START_FILL, _START_ROUND = 0.6, 0.15


def reference_frame(frames: Sequence[Dots]) -> int:
    """Return the first frame with the most dots that are shaped like dots.

    Raises
    ------
    InputError
        If no frame has three, or there are more than 400.
    """
    counts = [int(((d.fills > 0.75) & (d.fills < 1.35) & ~d.faint).sum()) for d in frames]
    # The minimum over neighbouring frames, so that a speck of one frame does not count.
    usual = np.array([min(counts[max(0, k - 2) : k + 3]) for k in range(len(counts))])
    best = int(np.argmax(usual)) if usual.max(initial=0) else int(np.argmax(counts))
    if counts[best] < LEAST_DOTS:
        raise InputError(
            f"no image shows {LEAST_DOTS} dots of the chosen colour; name it with --dots",
            "MARKERS_TOO_FEW",
        )
    if counts[best] > MOST_DOTS:
        raise InputError(
            f"an image shows {counts[best]} dots; expected at most {MOST_DOTS}; is another colour "
            "meant? name it with --dots",
            "TOO_LARGE",
        )
    return best


def track_dots(
    frames: Sequence[Dots],
    named: Sequence[DotName] = (),
    fixes: Sequence[Fix] = (),
    face: BoundVertices | None = None,
) -> Tracks:
    """Follow the dots of a film from its reference frame forwards and backwards.

    Dots without a track begin one, and tracks that do not meet in time and are one dot by the
    low-rank model of the face are joined. Each track is followed back from both ends to the
    reference; where that disagrees, or where a dot is far from its prediction by all others, it is
    a doubt.

    Parameters
    ----------
    frames : sequence of Dots, length F
    named : sequence of DotName
        Names of dots at places; the others are numbered from top to bottom.
    fixes : sequence of Fix
        Corrections of the user: from its frame on, the marker is followed anew.
    face : BoundVertices, optional
        Names the dots that `named` does not.

    Raises
    ------
    InputError
        If there are too few or too many dots, or a name or fix is of no frame or marker.
    """
    at = reference_frame(frames)
    first = frames[at]
    shaped = (first.fills > _START_FILL) & (first.roundness > _START_ROUND)
    start = np.flatnonzero(shaped & ~first.faint)
    start = start[reading_order(first.centres[start])]
    ahead, behind = frames[at:], frames[at::-1]
    forward = follow(ahead, start, first.centres[start])
    backward = follow(behind, start, first.centres[start])
    table = without_lone_samples(_merged(forward.dots, backward.dots, len(start)), at)
    agreed = _agreement(frames, table, at, len(start))
    cuts = tuple(sorted([at + c for c in forward.cuts] + [at - c + 1 for c in backward.cuts]))
    places = _places(frames, table)
    table, agreed = join_tracks(table, agreed, places)
    kept = _markers(table)
    left_out = int((((table >= 0).sum(axis=0) >= _LEAST_FRAMES) & ~kept).sum())
    table, agreed = table[:, kept], agreed[:, kept]
    names, unmatched = name_tracks(_places(frames, table), named, face, at)
    table, agreed, unused = apply_fixes(frames, table, agreed, names, fixes)
    found = finished_tracks(frames, table, agreed, at, cuts, left_out)
    return replace(found, names=names, unmatched=(*unmatched, *unused))


def reading_order(places: FloatArray) -> IntArray:
    """Return the order of places (N, 2) from top to bottom, those at one height from left on."""
    if not len(places):
        return np.zeros(0, dtype=np.int64)
    height = 0.5 * float(np.median(nearest_distances(places))) if len(places) > 1 else 1.0
    order = np.argsort(places[:, 1], kind="stable")
    rows = np.concatenate([[0], np.cumsum(np.diff(places[order, 1]) > max(height, 1.0) * 0.5)])
    return np.asarray(order[np.lexsort((places[order, 0], rows))])


def _merged(forward: IntArray, backward: IntArray, count: int) -> IntArray:
    """Return one table (F, T): the given tracks, then those born on the way."""
    ahead, behind = len(forward), len(backward)
    born = forward.shape[1] - count, backward.shape[1] - count
    table = np.full((ahead + behind - 1, count + sum(born)), HIDDEN)
    table[behind - 1 :, :count] = forward[:, :count]
    table[behind - 1 :, count : count + born[0]] = forward[:, count:]
    table[: behind - 1, :count] = backward[:0:-1, :count]
    table[: behind - 1, count + born[0] :] = backward[:0:-1, count:]
    return table


def _places(frames: Sequence[Dots], table: IntArray) -> FloatArray:
    places = np.full((*table.shape, 2), np.nan)
    for number, (dots, row) in enumerate(zip(frames, table, strict=True)):
        seen = row >= 0
        places[number, seen] = dots.centres[row[seen]]
    return places


def _agreement(frames: Sequence[Dots], table: IntArray, at: int, count: int) -> BoolArray:
    """Return where tracking back from the ends gives the same dots (F, T)."""
    agreed = np.ones(table.shape, dtype=bool)
    places = _places(frames, table)
    last = len(frames) - 1
    for end, part in ((last, slice(at, None)), (0, slice(at, None, -1))):
        order = range(last, at - 1, -1) if end else range(at + 1)
        if len(order) < 3:
            continue
        known = _last_places(places[part])
        back = follow([frames[k] for k in order], table[end], known, births=False).dots
        there = table[list(order)]
        wrong = (back >= 0) & (there >= 0) & (back != there)
        agreed[list(order)] &= ~wrong
    agreed[:, count:] = True  # a later track's way back has no beginning to compare with
    return agreed


def _last_places(places: FloatArray) -> FloatArray:
    """Return the last place (T, 2) at which each track of (F, T, 2) was seen."""
    seen = ~np.isnan(places[..., 0])
    last = np.where(seen, np.arange(len(places))[:, None], 0).max(axis=0)
    return np.asarray(np.nan_to_num(places[last, np.arange(places.shape[1])], nan=-1e6))


def _markers(table: IntArray) -> BoolArray:
    seen = (table >= 0).sum(axis=0)
    least = max(min(_LEAST_FRAMES, len(table)), _LEAST_SHARE * len(table))
    return np.asarray(seen >= least)
