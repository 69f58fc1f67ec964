"""Confidence of each proposed vertex."""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.pose_search import RegisteredMarkers
from usdface.binding.registration import USUAL_COST, total_errors

__all__ = ["placement_confidence"]

# A vertex is right when the true one is this near along the surface [share of the face's size]:
# 10 mm on a face whose moving surface has an RMS radius of 67 mm. A definition.
_NEAR = 0.15
# Set by hand; judge: `python benchmarks/binding.py`, which compares confidence and share of right
# vertices; docs/constants.md lists them. At this cost the best registration is as often
# wrong as right, unless three anchors determine the pose; how steeply that changes with the cost.
_HOPELESS_COST, _HOPELESS_POWER = 9.0, 6
# Share of the markers that counts as independent in the comparison of two registrations.
_INDEPENDENT = 0.25


def placement_confidence(registered: RegisteredMarkers, chosen: IntArray) -> FloatArray:
    """Return the probability that each marker's vertex is within 10 mm of the true one: (M,).

    The errors of place and motion make a distribution of each marker over the surface; several
    registrations are averaged by how well they explain all markers. One that fits badly is taken
    as one with larger errors. Distances run along the surface, so a lower lip is not near the
    upper one.

    Parameters
    ----------
    registered : RegisteredMarkers
    chosen : (M,) int64
        Index into the surface's vertices.
    """
    candidates, observations = registered.candidates, registered.observations
    surface = candidates.surface
    costs = np.array([one.cost for one in registered.registrations])
    spread = max(1.0, costs[0] / USUAL_COST)
    pose_right = 1.0
    if observations.anchored.sum() < 3:
        pose_right = 1.0 / (1.0 + (costs[0] / _HOPELESS_COST) ** _HOPELESS_POWER)
    likelihood = np.exp(-0.5 * _INDEPENDENT * len(chosen) * (costs - costs[0]) / spread)
    limit = _NEAR * candidates.size
    near = surface.distances(surface.vertices[chosen], limit) <= limit
    probability = np.zeros(len(chosen))
    for one, weight in zip(registered.registrations, likelihood / likelihood.sum(), strict=True):
        total = total_errors(candidates, observations, one)
        share = np.exp(-0.5 / spread * (total - total.min(axis=1, keepdims=True)))
        probability += weight * (share * near).sum(axis=1) / share.sum(axis=1)
    return np.where(observations.anchored, 1.0, pose_right * probability)
