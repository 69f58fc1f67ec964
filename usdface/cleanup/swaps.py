"""Swaps: two or more labels that change places from one frame to the next."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = ["last_seen", "owners"]

# Of the distance between neighbouring markers: what none moves in one frame, and how near to
# where another was a marker lands that is that other. A face marker has been seen to move by
# 2.5 mm in a thirtieth of a second (the lid of a blink); neighbours are some 20 mm apart.
_JUMP = 0.25
_LANDING = 0.5
# A jump is also larger than this many times what the marker does from frame to frame.
_USUAL = 6.0


def owners(still: FloatArray, seen: BoolArray, spacing: float) -> IntArray:
    """Follow the markers through the take: whose path each label is on.

    Where several labels jump in the same frame, and each lands where another of them was, they
    have changed places (linear assignment). What the labels are for most of the take is right.

    Parameters
    ----------
    still : (F, M, 3) float64
        Markers without the head's motion.
    seen : (F, M) bool
    spacing : float
        Distance between neighbouring markers.

    Returns
    -------
    (F, M) int64
        Label of the marker that each label shows; its own number where nothing is swapped.
    """
    count = still.shape[1]
    before = np.take_along_axis(still, last_seen(seen)[:-1, :, None], axis=0)
    away = np.linalg.norm(still[1:] - before, axis=2)
    away = np.nan_to_num(away, nan=0.0)
    jumps = away > np.maximum(_JUMP * spacing, _USUAL * np.median(away, axis=0))
    events = np.flatnonzero(jumps.sum(axis=1) >= 2)
    states, starts, lengths = [np.arange(count)], [0], []
    for event in events.tolist():
        who = np.flatnonzero(jumps[event])
        cost = np.linalg.norm(still[event + 1][who, None] - before[event][who], axis=2)
        lands = cost < _LANDING * cost.diagonal().clip(max=spacing)[:, None]
        # Who changes places lands where another was, and another where it was.
        if not (lands.any(axis=0) & lands.any(axis=1)).any():
            continue
        from scipy.optimize import linear_sum_assignment  # costs more to import than all of this

        at, was = linear_sum_assignment(cost)
        moved = at != was
        if not moved.any() or not lands[at, was][moved].all():
            continue
        state = states[-1].copy()
        state[who[at[moved]]] = states[-1][who[was[moved]]]
        lengths.append(event + 1 - starts[-1])
        starts.append(event + 1)
        states.append(state)
    lengths.append(len(still) - starts[-1])
    table, which = np.unique(np.array(states), axis=0, return_inverse=True)
    usual = table[np.bincount(which.reshape(-1), lengths).argmax()]
    named = np.empty(count, dtype=np.int64)
    named[usual] = np.arange(count)
    return np.repeat(named[np.array(states)], lengths, axis=0)


def last_seen(seen: BoolArray) -> IntArray:
    """Return the last frame up to each entry (F, M) that was seen; the first if there is none."""
    frames = np.where(seen, np.arange(len(seen))[:, None], 0)
    return np.asarray(np.maximum.accumulate(frames, axis=0))
