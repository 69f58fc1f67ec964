"""Tracks of a film from the dots of its images: followed both ways, joined, doubted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.low_rank_model import (
    FRAMES_PER_MODE,
    fit_low_rank_model,
    predict_from_others,
    reconstruct,
)
from usdface.errors import InputError
from usdface.footage.choose_channel import LEAST_DOTS, MOST_DOTS
from usdface.footage.dots import Dots
from usdface.footage.fixes import Fix, apply_fixes
from usdface.footage.follow import HIDDEN, follow, nearest_distances
from usdface.footage.labels import NamedPlace, name_tracks
from usdface.footage.similarity import fit_similarity
from usdface.footage.tracks import Doubt, Tracks

__all__ = ["reference_frame", "track_dots"]

# A track is a marker if it is seen in so many frames, and in this share of all.
_LEAST_FRAMES, _LEAST_SHARE = 3, 0.2
# Tracks begin at dots of this fill and roundness (seen at 80 degrees) in the reference frame.
_START_FILL, _START_ROUND = 0.6, 0.15
# Two tracks are one dot, or a track is that of another dot, by distance from where all others say
# that it is, as a share of the distance to the nearest neighbour.
_JOIN, _DOUBT = 0.4, 0.45
# A dot is hidden where less than this share of its area about that time is left, or more than the
# other and it fills less of its ellipse than one dot does (two discs side by side fill 0.89, a dot
# that the skin stretches 0.99); its confidence falls from 1 at `_FULL` on. Frames about it.
_PART, _MERGED, _FULL, _ONE = 0.35, 1.9, 0.8, 0.93
_ABOUT, _NEIGHBOURS = 8, 4
# Distance from where the others say [shares of the spacing] and deviation [px] at which confidence
# is 0.6; frames that disagree between both directions have this confidence.
_STRAY, _VAGUE, _DISAGREED = 0.3, 0.35, 0.3


def reference_frame(frames: Sequence[Dots]) -> int:
    """Return the first frame with the most dots that are shaped like dots.

    Raises
    ------
    InputError
        If no frame has three, or there are more than 400.
    """
    counts = [int(((dots.fills > 0.75) & (dots.fills < 1.35)).sum()) for dots in frames]
    # A speck that comes and goes does not choose the frame: a count that lasts does.
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
    named: Sequence[NamedPlace] = (),
    fixes: Sequence[Fix] = (),
) -> Tracks:
    """Follow the dots of a film from its reference frame forwards and backwards.

    Dots without a track begin one, and tracks that do not meet in time and are one dot by the
    low-rank model of the face are joined. Each track is followed back from both ends to the
    reference; where that disagrees, or where a dot is not where all others say, it is a doubt.

    Parameters
    ----------
    frames : sequence of Dots, length F
    named : sequence of NamedPlace
        Names of dots at places; the others are numbered from top to bottom.
    fixes : sequence of Fix
        Corrections of the user: from its frame on, the marker is followed anew.

    Raises
    ------
    InputError
        If there are too few or too many dots, or a name or fix is of no frame or marker.
    """
    at = reference_frame(frames)
    first = frames[at]
    start = np.flatnonzero((first.fills > _START_FILL) & (first.roundness > _START_ROUND))
    start = start[reading_order(first.centres[start])]
    ahead, behind = frames[at:], frames[at::-1]
    forward = follow(ahead, start, first.centres[start])
    backward = follow(behind, start, first.centres[start])
    table = _merged(forward.dots, backward.dots, len(start))
    agreed = _agreement(frames, table, at, len(start))
    cuts = tuple(sorted([at + c for c in forward.cuts] + [at - c + 1 for c in backward.cuts]))
    places = _places(frames, table)
    table, agreed = _joined(table, agreed, places)
    kept = _markers(table, len(start))
    left_out = int((((table >= 0).sum(axis=0) >= _LEAST_FRAMES) & ~kept).sum())
    table, agreed = table[:, kept], agreed[:, kept]
    names, unmatched = name_tracks(_places(frames, table), named)
    table, agreed, unused = apply_fixes(frames, table, agreed, names, fixes)
    found = _finished(frames, table, agreed, at, cuts, left_out)
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
    """Return where following back from the ends gives the same dots (F, T)."""
    agreed = np.ones(table.shape, dtype=bool)
    places = _places(frames, table)
    last = len(frames) - 1
    for end, part in ((last, slice(at, None)), (0, slice(at, None, -1))):
        order = range(last, at - 1, -1) if end else range(0, at + 1)
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


def _still(places: FloatArray) -> FloatArray:
    """Return places (F, M, 2) without the head's motion in the image."""
    home = _median_seen(places)
    still = np.full_like(places, np.nan)
    for _ in range(2):
        for frame, row in enumerate(places):
            seen = ~np.isnan(row[:, 0]) & ~np.isnan(home[:, 0])
            still[frame] = fit_similarity(row[seen], home[seen])(row)
        home = _median_seen(still)
    return still


def _median_seen(values: FloatArray) -> FloatArray:
    """Return the median (M, 2) of (F, M, 2) over the frames that are not NaN; NaN if all are."""
    result = np.full(values.shape[1:], np.nan)
    ever = ~np.isnan(values[..., 0]).all(axis=0)
    if ever.any():
        result[ever] = np.nanmedian(values[:, ever], axis=0)
    return result


def _joined(table: IntArray, agreed: BoolArray, places: FloatArray) -> tuple[IntArray, BoolArray]:
    """Join tracks that never meet and are one dot by what all others say."""
    seen = table >= 0
    counts = seen.sum(axis=0)
    main = np.flatnonzero(counts >= max(_LEAST_FRAMES, 0.4 * len(table)))
    rest = np.flatnonzero((counts >= 2) & (counts < 0.97 * len(table)))
    if len(main) < 4 or len(rest) < 2 or len(table) < FRAMES_PER_MODE:
        return table, agreed
    table, agreed = table.copy(), agreed.copy()
    whole = np.flatnonzero(counts >= 2)
    still = _still(places[:, whole])
    for _ in range(3):
        have = table[:, whole] >= 0
        cost = _join_costs(still, have)
        cost[:, counts[whole] == 0] = np.inf
        cost[counts[whole] == 0] = np.inf
        finite = np.isfinite(cost)
        if not finite.any():
            break
        rows, columns = linear_sum_assignment(np.where(finite, cost, 1e3))
        used: set[int] = set()
        for keep, drop in zip(rows.tolist(), columns.tolist(), strict=True):
            if not finite[keep, drop] or keep in used or drop in used:
                continue
            used |= {keep, drop}
            a, b = whole[keep], whole[drop]
            taken = table[:, b] >= 0
            table[taken, a], table[taken, b] = table[taken, b], HIDDEN
            agreed[taken, a] = agreed[taken, b]
            still[taken, keep], still[taken, drop] = still[taken, drop], np.nan
            counts[a], counts[b] = counts[a] + counts[b], 0
    return table, agreed


def _join_costs(still: FloatArray, have: BoolArray) -> FloatArray:
    """Return the distance over the gate of each track (T) from the dot of each earlier one (T)."""
    home = _median_seen(still)
    filled = np.where(np.isnan(still), np.nan_to_num(home), still)
    long = have.sum(axis=0) >= FRAMES_PER_MODE
    model, filled = fit_low_rank_model(still, have & long, filled)
    predicted = reconstruct(model, np.nan_to_num(still), have & long)
    count = have.shape[1]
    gate = _JOIN * nearest_distances(home[long]).clip(0.0, 1e6)
    limit = np.full(count, np.inf)
    limit[long] = gate
    overlap = have.T.astype(int) @ have.astype(int)
    cost = np.full((count, count), np.inf)
    for drop in range(count):
        mine = have[:, drop]
        away = np.linalg.norm(predicted[mine] - still[mine, drop][:, None], axis=2)
        share = np.median(away, axis=0) / limit if len(away) else np.full(count, np.inf)
        longer = have.sum(axis=0) >= mine.sum()
        fits = long & longer & (overlap[drop] == 0) & (share < 1.0)
        fits[drop] = False
        cost[fits, drop] = share[fits]
    return cost


def _markers(table: IntArray, count: int) -> BoolArray:
    seen = (table >= 0).sum(axis=0)
    least = max(min(_LEAST_FRAMES, len(table)), _LEAST_SHARE * len(table))
    return np.asarray(seen >= least)


def _finished(
    frames: Sequence[Dots],
    table: IntArray,
    agreed: BoolArray,
    at: int,
    cuts: tuple[int, ...],
    left_out: int,
) -> Tracks:
    shape = table.shape
    seen = table >= 0
    places, ellipses = np.full((*shape, 2), np.nan), np.full((*shape, 3), np.nan)
    deviations, areas, fills = (np.full(shape, np.nan) for _ in range(3))
    for number, (dots, row) in enumerate(zip(frames, table, strict=True)):
        mine, own = seen[number], row[seen[number]]
        places[number, mine] = dots.centres[own]
        ellipses[number, mine] = np.column_stack([dots.axes[own], dots.angles[own]])
        deviations[number, mine] = dots.deviations[own]
        areas[number, mine], fills[number, mine] = dots.areas[own], dots.fills[own]
    share = _whole_share(areas, places)
    merged = (share > _MERGED) & (fills < _ONE)
    hidden = seen & ((share < _PART) | merged)
    for values in (places, ellipses):
        values[hidden] = np.nan
    deviations[hidden] = np.nan
    seen &= ~hidden
    stray = _stray(places, seen)
    confidence = np.where(share < 1, ((share - _PART) / (_FULL - _PART)).clip(0.1, 1.0), 1.0)
    confidence *= np.exp(-0.5 * (np.nan_to_num(stray) / _STRAY) ** 2)
    confidence *= np.exp(-0.5 * (np.nan_to_num(deviations) / _VAGUE) ** 2)
    confidence = np.where(agreed, confidence, np.minimum(confidence, _DISAGREED))
    confidence = np.where(seen, confidence, 0.0)
    doubts = _doubts(seen & (~agreed | (stray > _DOUBT)))
    names = tuple(f"dot_{k + 1:02d}" for k in range(shape[1]))
    return Tracks(names, places, deviations, ellipses, confidence, at, cuts, doubts, left_out)


def _whole_share(areas: FloatArray, places: FloatArray) -> FloatArray:
    """Return each area (F, M) over the dot's usual one about that time, 1 where it is hidden.

    Divided by that of its neighbours: a face that turns away shows all of them smaller.
    """
    share = np.ones_like(areas)
    # The upper quartile of blocks: what is half hidden for long is not usual.
    count = max(1, round(len(areas) / (2 * _ABOUT)))
    blocks = np.array_split(np.arange(len(areas)), count)
    for number, block in enumerate(blocks):
        near = np.concatenate(blocks[max(0, number - 1) : number + 2])
        have = ~np.isnan(areas[near]).all(axis=0)
        usual = np.ones(areas.shape[1])
        usual[have] = np.nanpercentile(areas[near][:, have], 70, axis=0)
        share[block] = areas[block] / usual
    if areas.shape[1] > _NEIGHBOURS:
        home = np.nan_to_num(_median_seen(places), nan=1e6)
        order = np.argsort(np.linalg.norm(home[:, None] - home, axis=2), axis=1)
        around = np.nan_to_num(share, nan=1.0)[:, order[:, 1 : _NEIGHBOURS + 1]]
        share = share / np.minimum(np.median(around, axis=2), 1.0)
    return np.nan_to_num(share, nan=1.0)


def _stray(places: FloatArray, seen: BoolArray) -> FloatArray:
    """Return how far each dot (F, M) is from where all others say, in spacings; 0 = not known."""
    if len(places) < 3 * FRAMES_PER_MODE or places.shape[1] < 6:
        return np.zeros(seen.shape)
    still = _still(places)
    home = _median_seen(still)
    filled = np.where(np.isnan(still), home, still)
    model, _ = fit_low_rank_model(still, seen, filled)
    predicted = predict_from_others(model, np.nan_to_num(still), seen)
    away = np.linalg.norm(predicted - still, axis=2)
    return np.asarray(np.nan_to_num(away / nearest_distances(home)))


def _doubts(wrong: BoolArray) -> tuple[Doubt, ...]:
    """Return the stretches of each track (F, M) that are doubted."""
    found = []
    for track in np.flatnonzero(wrong.any(axis=0)).tolist():
        frames = np.flatnonzero(wrong[:, track])
        breaks = np.flatnonzero(np.diff(frames) > 2) + 1
        found += [Doubt(track, int(p[0]), int(p[-1])) for p in np.split(frames, breaks)]
    return tuple(found)
