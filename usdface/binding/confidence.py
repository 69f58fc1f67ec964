"""How sure each proposed place is."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.candidates import Domain
from usdface.binding.face_surface import FaceSurface
from usdface.binding.observations import Evidence
from usdface.binding.registration import Registration, closeness

__all__ = ["confidence"]

# A place is right when the true one is this near along the surface [share of the face's size]:
# 10 mm on a face whose moving skin has an RMS radius of 67 mm.
_NEAR = 0.15
# What markers cost on another face that fits well; more says that the errors are larger.
_USUAL_COST = 3.0
# At this cost the best answer is as often wrong as right, unless anchors hold the face.
_HOPELESS_COST = 9.0
# Two answers differ by as many independent markers as this share of them.
_INDEPENDENT = 0.25


def confidence(
    skin: FaceSurface,
    domain: Domain,
    evidence: Evidence,
    answers: Sequence[Registration],
    places: IntArray,
) -> FloatArray:
    """Return the probability that each marker's place is within 10 mm of the true one: (M,).

    The errors of place and motion make a distribution of each marker over the skin; of
    several answers each counts by how well it explains all markers. An answer that fits badly
    is taken as one with larger errors. Distances run along the surface, so a lower lip is
    not near the upper one.

    Parameters
    ----------
    skin : FaceSurface
    domain : Domain
        All of the skin.
    evidence : Evidence
    answers : sequence of Registration
        The best first.
    places : (M,) int64
        Index into the skin: the places that were chosen.
    """
    costs = np.array([answer.cost for answer in answers])
    spread = max(1.0, costs[0] / _USUAL_COST)
    whole = 1.0
    if (evidence.anchors >= 0).sum() < 3:
        whole = 1.0 / (1.0 + (costs[0] / _HOPELESS_COST) ** 6)
    says = np.exp(-0.5 * _INDEPENDENT * len(places) * (costs - costs[0]) / spread)
    limit = _NEAR * domain.size
    near = skin.reach(skin.vertices[places], limit) <= limit
    sure = np.zeros(len(places))
    for answer, say in zip(answers, says / says.sum(), strict=True):
        total = np.add(*closeness(domain, evidence, answer))
        share = np.exp(-0.5 / spread * (total - total.min(axis=1, keepdims=True)))
        sure += say * (share * near).sum(axis=1) / share.sum(axis=1)
    return np.where(evidence.anchors >= 0, 1.0, whole * sure)
