"""Label assignment: two or more labels that are swapped from one frame to the next."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = ["assign_labels", "cycles", "last_visible"]

# Shares of the distance between neighbouring markers: a motion that none has in one frame, and the
# distance from another marker's last place within which a jump ends on that marker. A face marker
# has been seen to move by 2.5 mm in a thirtieth of a second (the lid of a blink); neighbours are
# some 20 mm apart.
_JUMP = 0.25
_LANDING = 0.5
# A jump is also larger than this many times the marker's median motion from frame to frame.
_USUAL = 6.0


def assign_labels(
    positions: FloatArray,
    visible: BoolArray,
    spacing: float,
    right: tuple[int, int] | None = None,
) -> IntArray:
    """Assign each label to the marker that it shows, by following the markers through the take.

    Labels that jump in the same frame, each to where another of them was, are swapped (linear
    assignment). A label that is hidden in that frame counts by where it comes back. The labels of
    most of the `right` frames are right.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        Markers without head motion.
    visible : (F, M) bool
    spacing : float [m]
        Usual distance between neighbouring markers.
    right : (int, int), optional
        First and last frame whose labels are right, inclusive; all frames, if left out or not in
        the take.

    Returns
    -------
    (F, M) int64
        Index of the marker that each label shows; its own where nothing is swapped.
    """
    count = positions.shape[1]
    before = np.take_along_axis(positions, last_visible(visible)[:-1, :, None], axis=0)
    after = np.take_along_axis(positions, _next_visible(visible)[1:, :, None], axis=0)
    away = np.nan_to_num(np.linalg.norm(after - before, axis=2), nan=0.0)
    usual_motion = np.median(np.where(visible[1:], away, 0.0), axis=0)
    jumps = away > np.maximum(_JUMP * spacing, _USUAL * usual_motion)
    events = np.flatnonzero((jumps.sum(axis=1) >= 2) & (jumps & visible[1:]).any(axis=1))
    states, starts, lengths = [np.arange(count)], [0], []
    for event in events.tolist():
        who = np.flatnonzero(jumps[event])
        cost = np.linalg.norm(after[event][who, None] - before[event][who], axis=2)
        lands = cost < _LANDING * cost.diagonal().clip(max=spacing)[:, None]
        # A swap is mutual.
        if not (lands.any(axis=0) & lands.any(axis=1)).any():
            continue
        from scipy.optimize import linear_sum_assignment  # costs more to import than all of this

        at, was = linear_sum_assignment(cost)
        # Labels that are all hidden have not come back yet.
        shown = [c for c in cycles(was) if visible[event + 1][who[c]].any()]
        moved = np.isin(at, [label for cycle in shown for label in cycle])
        if not moved.any() or not lands[at, was][moved].all():
            continue
        state = states[-1].copy()
        state[who[at[moved]]] = states[-1][who[was[moved]]]
        lengths.append(event + 1 - starts[-1])
        starts.append(event + 1)
        states.append(state)
    lengths.append(len(positions) - starts[-1])
    table, which = np.unique(np.array(states), axis=0, return_inverse=True)
    of_frames = np.repeat(which.reshape(-1), lengths)
    if right is not None and 0 <= right[0] <= right[1] < len(positions):
        of_frames = of_frames[right[0] : right[1] + 1]
    usual = table[np.bincount(of_frames).argmax()]
    named = np.empty(count, dtype=np.int64)
    named[usual] = np.arange(count)
    return np.repeat(named[np.array(states)], lengths, axis=0)


def cycles(permutation: IntArray) -> list[list[int]]:
    """Return the cycles of a permutation of (M,) that move something."""
    found: list[list[int]] = []
    left = set(np.flatnonzero(permutation != np.arange(len(permutation))).tolist())
    while left:
        cycle = [min(left)]
        while (following := int(permutation[cycle[-1]])) != cycle[0]:
            cycle.append(following)
        left.difference_update(cycle)
        found.append(cycle)
    return found


def _next_visible(visible: BoolArray) -> IntArray:
    """Return the first frame from each entry (F, M) on that is visible; the last if none is."""
    return len(visible) - 1 - last_visible(visible[::-1])[::-1]


def last_visible(visible: BoolArray) -> IntArray:
    """Return the last frame up to each entry (F, M) that is visible; 0 if there is none."""
    frames = np.where(visible, np.arange(len(visible))[:, None], 0)
    return np.asarray(np.maximum.accumulate(frames, axis=0))
