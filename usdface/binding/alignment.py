"""Registration of anonymous markers to a rig's face by shape and motion together.

Unknown are the similarity between performer and character, the smooth difference of the two
faces, the rig's weights in each peak frame, and the vertex of each marker. Given three of these
the fourth is a small least-squares problem, so they alternate: iterated closest points (Besl and
McKay 1992) with soft assignments (Granger and Pennec 2002), whose distance counts place *and*
motion. A vertex is near a marker if its position and the motion that the rig can give it are. This
converges to the nearest local optimum; `usdface.binding.pose_search` starts it from all poses.
"""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.candidates import CandidateVertices
from usdface.binding.observations import Observations
from usdface.binding.peak_motion import Targets, peak_motion
from usdface.binding.registration import (
    MOTION_ERROR,
    SHAPE_ERROR,
    Registration,
    expected_scale,
    named_errors,
    squared_distances,
    squared_errors,
    trust_of,
)
from usdface.geometry.rigid_fit import mean_scale

__all__ = ["align", "name_disagreement", "predicted_by_others"]

# Prior of the smooth difference of two faces beyond size and pose: a Gaussian process with this
# deviation of a coordinate and this length scale, shorter where names hold the markers.
_BEND, _BEND_WIDTH, _NAMED_BEND_WIDTH = 0.055, 0.7, 0.5
# Deviation of the logarithm of the ratio of the markers' spread to that of the moving surface.
_SPREAD = 0.15
# Recorded heads are mostly upright: cost of one that is not, by 1 - cosine.
_UPRIGHT = 0.5
# Weight of an anchored marker in the fits, against 1 of one that fits perfectly.
_ANCHOR_WEIGHT = 10.0
# Cost of names that contradict the height on the face, by 1 - correlation.
_NAMED = 3.0
# Markers whose mirror images are nearer than this are a pair.
_PAIRED = 0.2


def align(
    candidates: CandidateVertices,
    observations: Observations,
    registration: Registration,
    *,
    shape_error: float = SHAPE_ERROR,
    motion_error: float = MOTION_ERROR,
    soft: bool = True,
    clipped: bool = False,
) -> Registration:
    """Assign markers to candidates, then fit the similarity, the bend and the weights to them.

    Parameters
    ----------
    candidates : CandidateVertices
    observations : Observations
    registration : Registration
    shape_error, motion_error : float
        Of `squared_errors`.
    soft : bool
        Spread a marker over all its candidates by their likelihood, instead of the likeliest.
    clipped : bool
        Clip the weights of an unbounded solve, which is faster, instead of solving within bounds.
    """
    place, motion = squared_errors(
        candidates,
        observations,
        registration,
        shape_error=shape_error,
        motion_error=motion_error,
    )
    total = place + motion + named_errors(candidates, observations)
    fixed = observations.anchored
    rows = np.arange(len(total))
    assigned = total.argmin(axis=1)
    assigned[fixed] = np.searchsorted(candidates.indices, observations.anchors[fixed])
    costs = total[rows, assigned]
    trust = np.where(fixed, _ANCHOR_WEIGHT, trust_of(costs))
    if soft:
        points, offsets = _soft_targets(candidates, total, assigned, fixed=fixed)
    else:
        points, offsets = candidates.points[assigned], candidates.offsets[:, assigned]
    linear, offset = _similarity(observations.neutral, points, trust)
    mapped = observations.neutral @ linear + offset
    bends = _bends(mapped, candidates, observations)
    noise = (0.5 * candidates.size) ** 2 / trust
    pull = np.linalg.solve(bends + np.diag(shape_error**2 * noise), points - mapped)
    weights, rigid = peak_motion(
        Targets(points, offsets, trust),
        observations.displacements @ linear,
        observations.visible,
        start=registration,
        bounds="clipped" if clipped else "solved",
    )
    bend = bends @ pull
    if soft:
        bend = bend + _mirror_correction(mapped + bend, candidates)
    cost = motion[rows, assigned].mean() + _misfit_cost(
        linear, points - mapped, bends + np.diag(SHAPE_ERROR**2 * noise), candidates, observations
    )
    cost += _NAMED * name_disagreement(mapped, observations)
    return replace(
        registration,
        linear=linear,
        offset=offset,
        bend=bend,
        weights=weights,
        rigid=rigid,
        assigned=assigned,
        marker_costs=costs,
        cost=float(cost),
    )


def _misfit_cost(
    linear: FloatArray,
    rest: FloatArray,
    covariance: FloatArray,
    candidates: CandidateVertices,
    observations: Observations,
) -> float:
    """Return the cost of bend, size and pose.

    `rest` (M, 3) [m] is the residual of the places by the similarity `linear`, `covariance` (M, M)
    [m^2] that of one of its coordinates.
    """
    strain = float((rest * np.linalg.solve(covariance, rest)).sum()) / len(rest)
    size = np.log(mean_scale(linear) / expected_scale(candidates, observations)) / _SPREAD
    tilt = 1.0 - linear[1, 1] / np.linalg.norm(linear[1])
    return float(strain + 0.5 * size**2 + _UPRIGHT * tilt)


def predicted_by_others(
    candidates: CandidateVertices, observations: Observations, registration: Registration
) -> tuple[FloatArray, FloatArray]:
    """Predict each marker's place from all others: (M, 3) [m] from the centre, (M,).

    The second is the variance of a coordinate [m^2]. Leave-one-out residuals of the Gaussian
    process of the bend (C. E. Rasmussen, C. K. I. Williams, "Gaussian Processes for Machine
    Learning", 2006, eq. 5.12).
    """
    mapped = observations.neutral @ registration.linear + registration.offset
    trust = trust_of(registration.marker_costs)
    noise = SHAPE_ERROR**2 * (0.5 * candidates.size) ** 2 / trust
    inverse = np.linalg.inv(_bends(mapped, candidates, observations) + np.diag(noise))
    points = candidates.points[registration.assigned]
    variance = 1.0 / np.diagonal(inverse)
    return points - (inverse @ (points - mapped)) * variance[:, None], variance


def _bends(
    mapped: FloatArray, candidates: CandidateVertices, observations: Observations
) -> FloatArray:
    """Return the prior covariance of the bend at markers (M, 3) [m]: (M, M) [m^2]."""
    width = candidates.size * (_BEND_WIDTH if observations.named is None else _NAMED_BEND_WIDTH)
    return np.asarray(
        (_BEND * candidates.size) ** 2
        * np.exp(-squared_distances(mapped, mapped) / (2.0 * width**2))
    )


def name_disagreement(mapped: FloatArray, observations: Observations) -> float:
    """Return 1 - the correlation of height on the face and height by name; 0 without names.

    `mapped` (M, 3) are neutral markers in the character's space.
    """
    known = ~np.isnan(observations.heights)
    if not known.any():
        return 0.0
    return 1.0 - float(np.corrcoef(mapped[known, 1], observations.heights[known])[0, 1])


def _soft_targets(
    candidates: CandidateVertices, total: FloatArray, assigned: IntArray, *, fixed: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the expected point (M, 3) and offsets (S, M, 3) of each marker over its candidates.

    By their squared errors `total` (M, N); `fixed` markers are on the `assigned` one alone.
    """
    share = candidates.areas * np.exp(-0.5 * (total - total.min(axis=1, keepdims=True)))
    share[fixed] = 0.0
    share[np.flatnonzero(fixed), assigned[fixed]] = 1.0
    share /= share.sum(axis=1, keepdims=True)
    flat = candidates.offsets.transpose(1, 0, 2).reshape(len(candidates.points), -1)
    offsets = (share @ flat).reshape(len(total), -1, 3)
    return share @ candidates.points, offsets.transpose(1, 0, 2)


def _similarity(
    source: FloatArray, target: FloatArray, trust: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Fit a similarity, its scale by the spreads alone: errors of the targets do not shrink it."""
    share = trust / trust.sum()
    centre, middle = share @ source, share @ target
    a, b = source - centre, target - middle
    u, _, vt = np.linalg.svd((b * share[:, None]).T @ a)
    turn = (u * [1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))]) @ vt
    scale = np.sqrt((share @ (b**2).sum(axis=1)) / (share @ (a**2).sum(axis=1)))
    linear = max(float(scale), 1e-9) * turn.T
    return np.asarray(linear), np.asarray(middle - centre @ linear)


def _mirror_correction(points: FloatArray, candidates: CandidateVertices) -> FloatArray:
    """Return displacements that make mapped markers (M, 3) the mirror images of their partners.

    Performers wear markers in pairs, or on the middle line: two are partners where each is the
    nearest to the other's mirror image.
    """
    apart = squared_distances(points, points * [-1.0, 1.0, 1.0])
    partner = apart.argmin(axis=1)
    mutual = partner[partner] == np.arange(len(points))
    mutual &= apart.min(axis=1) < (_PAIRED * candidates.size) ** 2
    middle = 0.5 * (points + points[partner] * [-1.0, 1.0, 1.0])
    return np.where(mutual[:, None], middle - points, 0.0)
