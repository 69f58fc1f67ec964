"""The markers of a take that can be placed: seen, and no copies of others."""

import numpy as np

from usdface.arrays import IntArray
from usdface.binding.proposal import DuplicateMarker
from usdface.binding.stabilised_take import FEWEST_MARKERS
from usdface.errors import InputError
from usdface.takes import MarkerTake

__all__ = ["FEWEST", "distinct_markers"]

# Fewer markers fit any face. With three anchors, which determine the pose, as many as
# `neutral_frames` needs are enough.
FEWEST, _ANCHORS = 8, 3
# Markers that stay this near to each other are one [share of their spread; ICT: 0.7 mm]: less than
# a marker's own size.
_SAME_MARKER = 0.01


def distinct_markers(
    take: MarkerTake, given: dict[str, int]
) -> tuple[IntArray, tuple[DuplicateMarker, ...]]:
    """Return the indices (K,) of visible markers without duplicates, and the duplicates.

    `given` has the vertices of markers that are bound.

    Raises
    ------
    InputError
        If fewer markers are left than a registration needs.
    """
    used = np.flatnonzero(take.visible.any(axis=0))
    copies = _copies(take, used, given)
    used = np.delete(used, sorted(copies))
    anchored = len(given.keys() & {take.names[i] for i in used})
    least = FEWEST_MARKERS if anchored >= _ANCHORS else FEWEST
    if len(used) < least:
        apart = " at different places" if copies else ""
        raise InputError(
            f"the take {take.source} shows {len(used)} markers{apart}; proposing their vertices "
            f"takes {FEWEST}, or {FEWEST_MARKERS} of which three are in --bind bind.json",
            "MARKERS_TOO_FEW",
        )
    return used, tuple(copies.values())


def _copies(take: MarkerTake, used: IntArray, given: dict[str, int]) -> dict[int, DuplicateMarker]:
    """Return the markers that are always at the position of another, by index into `used`."""
    if len(used) < 2:
        return {}
    positions = take.positions
    middle = np.nanmedian(positions[:, used], axis=0)
    size = np.sqrt(((middle - np.median(middle, axis=0)) ** 2).sum(axis=1).mean())
    copies: dict[int, DuplicateMarker] = {}
    near = np.linalg.norm(middle[:, None] - middle, axis=2) < _SAME_MARKER * size
    for a, b in np.argwhere(np.triu(near, 1)).tolist():
        apart = np.linalg.norm(positions[:, used[a]] - positions[:, used[b]], axis=1)
        if a not in copies and not (apart > _SAME_MARKER * size).any():
            copy, original = (a, b) if take.names[used[b]] in given else (b, a)
            duplicate = DuplicateMarker(take.names[used[copy]], take.names[used[original]])
            copies.setdefault(copy, duplicate)
    return copies
