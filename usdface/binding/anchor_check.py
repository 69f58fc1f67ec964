"""Given places that cannot be right: a marker glued to the wrong vertex by hand."""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, IntArray
from usdface.binding.candidates import Domain
from usdface.binding.face_surface import FaceSurface
from usdface.binding.observations import Evidence
from usdface.binding.pose_search import released, search
from usdface.binding.registration import Registration, closeness

__all__ = ["doubted"]

# A given place is doubted if the marker fits another one better by this [squared errors], and
# that is so far away along the skin [share of the face's size; ICT: 20 mm].
_BETTER, _AWAY = 16.0, 0.3
# What markers cost on another face that fits well, and on one that may be another answer.
_USUAL_COST, _POOR_COST = 3.0, 5.0


def doubted(
    skin: FaceSurface, domain: Domain, evidence: Evidence, answer: Registration
) -> tuple[BoolArray, IntArray]:
    """Return which given places are doubted, and where the markers fit best: (M,), (M,).

    The answer that the given places led to is let go of them, and looked at again.

    Parameters
    ----------
    skin : FaceSurface
    domain : Domain
        All of the skin.
    evidence : Evidence
    answer : Registration
        Found with the given places.

    Returns
    -------
    (M,) bool
    (M,) int64
        Indices into the skin.
    """
    free = replace(evidence, anchors=np.full_like(evidence.anchors, -1))
    again = released(skin, domain, free, answer)
    if again.cost > _POOR_COST:
        # Too wrong to find the way back from.
        again = min((again, *search(skin, free)[1]), key=lambda one: one.cost)
    total = np.add(*closeness(domain, free, again))
    best, rows = total.argmin(axis=1), np.arange(len(total))
    given = evidence.anchors
    known = np.where(given >= 0, given, best)
    gap = (total[rows, known] - total[rows, best]) / max(1.0, again.cost / _USUAL_COST)
    doubt = (given >= 0) & (gap > _BETTER)
    for i in np.flatnonzero(doubt):
        limit = _AWAY * domain.size
        doubt[i] = skin.reach(skin.vertices[[known[i]]], limit)[0, best[i]] > limit
    return doubt, best
