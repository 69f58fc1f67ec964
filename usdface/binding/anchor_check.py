"""Check of given vertices: a marker may fit another vertex much better."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.binding.observations import Observations
from usdface.binding.pose_search import RegisteredMarkers, refine, search_pose
from usdface.binding.registration import USUAL_COST, total_errors

__all__ = ["DoubtedAnchor", "check_anchors", "without_anchors"]

# A given vertex is doubted if another one fits better by this difference of squared errors (four
# deviations), and is this far away along the surface [share of the face's size; ICT: 20 mm].
# `python benchmarks/binding.py given` counts right ones doubted and wrong ones not doubted.
_BETTER, _AWAY = 16.0, 0.3
# A registration of more than this cost may be the wrong one (`registration.USUAL_COST` is a good
# one's): the search starts anew, without anchors. Set by hand, with the same judge.
_POOR_COST = 5.0


@dataclass(frozen=True, slots=True)
class DoubtedAnchor:
    """A marker whose given vertex does not fit the other markers.

    Attributes
    ----------
    marker : int
        Index into the observations.
    given, better : int
        The given vertex of the mesh, and the one that fits best.
    distance : float [m]
        Between them along the surface.
    """

    marker: int
    given: int
    better: int
    distance: float


def check_anchors(registered: RegisteredMarkers) -> tuple[DoubtedAnchor, ...]:
    """Return the anchors that fit another vertex better.

    The registration that was found with the anchors is refined without them, by shape and motion
    alone.
    """
    candidates, surface = registered.candidates, registered.candidates.surface
    given = registered.observations.anchors
    free = without_anchors(registered.observations, range(len(given)))
    found = refine(registered, free)
    if found.cost > _POOR_COST and free.named is None:
        # Too wrong to be refined.
        others = search_pose(surface, free).registrations
        found = min((found, *others), key=lambda one: one.cost)
    total = total_errors(candidates, free, found)
    best, rows = total.argmin(axis=1), np.arange(len(total))
    known = np.where(given >= 0, given, best)
    gap = (total[rows, known] - total[rows, best]) / max(1.0, found.cost / USUAL_COST)
    limit = _AWAY * candidates.size
    doubted = []
    for i in np.flatnonzero((given >= 0) & (gap > _BETTER)).tolist():
        at = int(surface.vertices[known[i]])
        distance = float(surface.distances(np.array([at]))[0, best[i]])
        if distance > limit:
            doubted.append(DoubtedAnchor(i, at, int(surface.vertices[best[i]]), distance))
    return tuple(doubted)


def without_anchors(observations: Observations, markers: Sequence[int]) -> Observations:
    """Return the observations without the anchors of some markers, by their indices."""
    dropped = np.isin(np.arange(len(observations.anchors)), markers)
    return replace(observations, anchors=np.where(dropped, -1, observations.anchors))
