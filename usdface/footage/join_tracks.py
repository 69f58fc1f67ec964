"""Joining of tracks of one dot, by its places predicted from all others."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.low_rank_model import FRAMES_PER_MODE, fit_low_rank_model, reconstruct
from usdface.footage.follow import HIDDEN, nearest_distances
from usdface.footage.still_places import median_visible, still_places

__all__ = ["join_tracks", "without_lone_samples"]

# Distance from the place predicted by all others below which two tracks are one dot, as a share of
# the distance to the nearest neighbour.
_JOIN = 0.4
# Frames that a track needs to be joined to.
_LEAST_FRAMES = 3
# A spot that is mistaken for an occluded dot vanishes again: fewer images than this are no return
# of a dot, nor is one that flickers after this many images without the dot. Gaps of this many
# images do not end a stretch. Of 22 films before a phone (5 to 115 s of the recording) three had
# such spots, up to 70 px from the dot.
_RETURN, _ABSENT, _GAP = 5, 10, 2


def without_lone_samples(table: IntArray, at: int) -> IntArray:
    """Return the table without stretches of a track that are too short to be its dot's return.

    Parameters
    ----------
    table : (F, T) int64
        The dot of each track in each frame, or HIDDEN.
    at : int
        The reference frame, in which dots are verified: its stretches are kept.
    """
    table = table.copy()
    for track in np.flatnonzero((table >= 0).any(axis=0)).tolist():
        frames = np.flatnonzero(table[:, track] >= 0)
        stretches = np.split(frames, np.flatnonzero(np.diff(frames) > _GAP + 1) + 1)
        least = min(_RETURN, max(map(len, stretches)))
        kept: list[int] = []  # the frames nearest to the reference are judged first
        for stretch in sorted(stretches, key=lambda own: np.abs(own - at).min()):
            away = [abs(frame - end) for frame in kept for end in stretch[[0, -1]].tolist()]
            absent = min(away, default=1) - 1
            lasting = _longest_run(stretch) if absent >= _ABSENT else len(stretch)
            if lasting < least and at not in stretch:
                table[stretch, track] = HIDDEN
            else:
                kept += stretch[[0, -1]].tolist()
    return table


def _longest_run(frames: IntArray) -> int:
    """Return how many of some frames follow each other at most."""
    ends = np.flatnonzero(np.diff(frames) > 1)
    return int(np.diff(np.concatenate([[-1], ends, [len(frames) - 1]])).max())


def join_tracks(
    table: IntArray, agreed: BoolArray, places: FloatArray
) -> tuple[IntArray, BoolArray]:
    """Join tracks that never overlap in time and are one dot as predicted by all others.

    Parameters
    ----------
    table : (F, T) int64
        Index of each track's dot among those of the frame; below 0 = none.
    agreed : (F, T) bool
        Where following forwards and backwards gave the same dot.
    places : (F, T, 2) float64 [px]
        NaN where there is no dot.

    Returns
    -------
    table, agreed
        Of the joined tracks; those that were joined to another one are empty.
    """
    seen = table >= 0
    counts = seen.sum(axis=0)
    main = np.flatnonzero(counts >= max(_LEAST_FRAMES, 0.4 * len(table)))
    rest = np.flatnonzero((counts >= 2) & (counts < 0.97 * len(table)))
    if len(main) < 4 or len(rest) < 2 or len(table) < FRAMES_PER_MODE:
        return table, agreed
    table, agreed = table.copy(), agreed.copy()
    whole = np.flatnonzero(counts >= 2)
    still = still_places(places[:, whole])
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
    home = median_visible(still)
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
