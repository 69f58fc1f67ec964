"""Registration of anonymous markers to a rig's face by shape and motion together.

Unknown are the similarity between performer and character, the smooth difference of the two
faces, the rig's weights in each peak frame, and the vertex of each marker. Given three of these
the fourth is a small least-squares problem, so they alternate: iterated closest points (Besl and
McKay 1992) with soft assignments (Granger and Pennec 2002), whose distance counts place *and*
motion. A vertex is near a marker if it lies there and the rig can move it so. This converges to
the nearest local optimum; `usdface.binding.pose_search` starts it from all poses.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.candidates import CandidateVertices
from usdface.binding.name_priors import name_errors
from usdface.binding.observations import Observations
from usdface.geometry.rigid_modes import infinitesimal_motions
from usdface.retarget.bounded_least_squares import solve_bounded

__all__ = [
    "MOTION_ERROR",
    "SHAPE_ERROR",
    "USUAL_COST",
    "Registration",
    "align",
    "expected_scale",
    "name_disagreement",
    "predicted_by_others",
    "squared_errors",
    "total_errors",
    "unexplained_motion",
]

# Lengths are shares of the face's size, the RMS radius of its moving surface (ICT: 67 mm). Numbers
# without another source were set by hand; judge: `python benchmarks/binding.py`;
# docs/constants.md lists them.

# Standard deviations of a marker's place once the face is carried over and bent, and of its motion.
SHAPE_ERROR, MOTION_ERROR = 0.06, 0.02
# Where names tell the places the motion need not find them: its error is so many times as large,
# as that of real performers on other faces is; judge: `python benchmarks/binding.py named`.
_NAMED_MOTION = 3.0
# Cost of a registration to another face that fits well; a larger one says that the errors are.
USUAL_COST = 3.0
# Prior of the smooth difference of two faces beyond size and pose: a Gaussian process with this
# deviation of a coordinate and this length scale, shorter where names hold the markers.
_BEND, _BEND_WIDTH, _NAMED_BEND_WIDTH = 0.055, 0.7, 0.5
# Moving markers spread like the moving surface: bias and deviation of the logarithm of the ratio
# (mean of three performers each of ICT's face and the example's: -0.20 to -0.04).
_SPREAD_BIAS, _SPREAD = -0.14, 0.15
# Independent observations of a marker's motion in all peak frames, which resemble each other.
_INDEPENDENT_PEAKS = 8.0
# Degrees of freedom of the Student-t errors, so that one marker off the face does not pull all
# (K. Lange, R. Little, J. Taylor, "Robust statistical modeling using the t distribution", 1989).
_DEGREES_OF_FREEDOM = 8.0
# Recorded heads are mostly upright: cost of one that is not, by 1 - cosine.
_UPRIGHT = 0.5
# Weight of an anchored marker in the fits, against 1 of one that fits perfectly.
_ANCHOR_WEIGHT = 10.0
# Cost of names that contradict the height on the face, by 1 - correlation.
_NAMED = 3.0
# Markers whose mirror images are nearer than this are a pair.
_PAIRED = 0.2
# Prior of the weights: keeps shapes that hardly show at 0, as if a weight were about 0.4.
_WEIGHT_PRIOR = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class Registration:
    """A registration of M markers to N candidates, with the weights of K peak frames.

    Attributes
    ----------
    linear : (3, 3) float64
        Scale times rotation: row vectors of the performer's space times it are the character's.
    offset : (3,) float64 [m]
    bend : (M, 3) float64 [m]
        Smooth displacement of the markers beyond the similarity.
    weights : (K, S) float64 in [0, 1]
    rigid : (K, 6) float64
        Residual head motion in the peak frames (`CandidateVertices.rigid_motions`).
    assigned : (M,) int64
        Index of each marker's candidate.
    marker_costs : (M,) float64
        Squared errors of place and motion there, in units of the expected ones.
    cost : float
        Mean over the markers, with the costs of scale, bend and pose.
    """

    linear: FloatArray
    offset: FloatArray
    bend: FloatArray
    weights: FloatArray
    rigid: FloatArray
    assigned: IntArray
    marker_costs: FloatArray
    cost: float


@dataclass(frozen=True, eq=False, slots=True)
class _Targets:
    """Assigned markers: their points (M, 3), blend shape offsets (S, M, 3) and trust (M,)."""

    points: FloatArray
    offsets: FloatArray
    trust: FloatArray


def expected_scale(candidates: CandidateVertices, observations: Observations) -> float:
    """Return the expected ratio of the character's size to the performer's."""
    return float(np.exp(_SPREAD_BIAS)) * candidates.size / observations.spread


def squared_errors(
    candidates: CandidateVertices,
    observations: Observations,
    registration: Registration,
    *,
    shape_error: float = SHAPE_ERROR,
    motion_error: float = MOTION_ERROR,
) -> tuple[FloatArray, FloatArray]:
    """Return squared errors of place and of motion of each marker at each candidate.

    In units of the expected errors, which grow with the registration's scale: otherwise the
    smallest face would always fit best.

    Parameters
    ----------
    candidates : CandidateVertices
    observations : Observations
    registration : Registration
    shape_error, motion_error : float
        Expected errors as shares of the face's size.

    Returns
    -------
    place, motion : (M, N) float64
    """
    ratio = _scale(registration.linear) / expected_scale(candidates, observations)
    unit = candidates.size * ratio
    carried = observations.neutral @ registration.linear + registration.offset + registration.bend
    place = _squared_distances(carried, candidates.points) / (shape_error * unit) ** 2
    count = len(registration.weights)
    predicted = registration.weights @ candidates.offsets.reshape(len(candidates.offsets), -1)
    predicted += registration.rigid @ candidates.rigid_motions.reshape(6, -1)
    vertex = np.ascontiguousarray(predicted.reshape(count, -1, 3).transpose(1, 0, 2))
    marker = (observations.displacements @ registration.linear).transpose(1, 0, 2)
    visible = observations.visible.T.astype(np.float64)
    own = np.einsum("mkd,mkd,mk->m", marker, marker, visible)
    both = (marker * visible[..., None]).reshape(len(marker), -1) @ vertex.reshape(
        len(vertex), -1
    ).T
    theirs = visible @ np.einsum("nkd,nkd->kn", vertex, vertex)
    motion = (own[:, None] - 2.0 * both + theirs).clip(min=0.0)
    independent = _INDEPENDENT_PEAKS / np.maximum(visible.sum(axis=1), 1.0)
    trusted = 1.0 if observations.named is None else _NAMED_MOTION
    motion *= independent[:, None] / (trusted * motion_error * unit) ** 2
    # Heavy tails: a motion that no vertex has does not decide where its marker sits.
    return place, _DEGREES_OF_FREEDOM * np.log1p(motion / _DEGREES_OF_FREEDOM)


def total_errors(
    candidates: CandidateVertices, observations: Observations, registration: Registration
) -> FloatArray:
    """Return the squared errors of place, motion and name of each marker at each candidate: (M, N).

    In units of the expected errors.
    """
    place, motion = squared_errors(candidates, observations, registration)
    return np.asarray(place + motion + _named_errors(candidates, observations))


def _named_errors(candidates: CandidateVertices, observations: Observations) -> FloatArray | float:
    if observations.named is None:
        return 0.0
    return name_errors(observations.named, candidates.points + candidates.centre)


def unexplained_motion(
    candidates: CandidateVertices, observations: Observations, registration: Registration
) -> float:
    """Return the mean squared motion of the markers that the rig cannot explain where they sit.

    In units of the expected squared error. The rig's weights are 0 or more, so a false neutral,
    with an open mouth say, leaves more: the way back to the true one cannot be gone.
    """
    targets = _Targets(
        candidates.points[registration.assigned],
        candidates.offsets[:, registration.assigned],
        _trust(registration.marker_costs),
    )
    moves = observations.displacements @ registration.linear
    weights, rigid = _peak_motion(
        targets, moves, observations.visible, start=registration, clipped=False
    )
    predicted = weights @ targets.offsets.reshape(len(targets.offsets), -1)
    predicted += rigid @ infinitesimal_motions(targets.points).reshape(6, -1)
    squared = ((moves - predicted.reshape(moves.shape)) ** 2).sum(axis=2)
    frames = np.maximum(observations.visible.sum(axis=0), 1)
    each = (squared * observations.visible).sum(axis=0) / frames
    return float(each.mean()) / (MOTION_ERROR * candidates.size) ** 2


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
    total = place + motion + _named_errors(candidates, observations)
    fixed = observations.anchored
    rows = np.arange(len(total))
    assigned = total.argmin(axis=1)
    assigned[fixed] = np.searchsorted(candidates.indices, observations.anchors[fixed])
    costs = total[rows, assigned]
    trust = np.where(fixed, _ANCHOR_WEIGHT, _trust(costs))
    if soft:
        points, offsets = _soft_targets(candidates, total, assigned, fixed=fixed)
    else:
        points, offsets = candidates.points[assigned], candidates.offsets[:, assigned]
    linear, offset = _similarity(observations.neutral, points, trust)
    carried = observations.neutral @ linear + offset
    bends = _bends(carried, candidates, observations)
    noise = (0.5 * candidates.size) ** 2 / trust
    pull = np.linalg.solve(bends + np.diag(shape_error**2 * noise), points - carried)
    weights, rigid = _peak_motion(
        _Targets(points, offsets, trust),
        observations.displacements @ linear,
        observations.visible,
        start=registration,
        clipped=clipped,
    )
    bend = bends @ pull
    if soft:
        bend = bend + _mirror_correction(carried + bend, candidates)
    rest = points - carried
    strain = (rest * np.linalg.solve(bends + np.diag(SHAPE_ERROR**2 * noise), rest)).sum()
    size = np.log(_scale(linear) / expected_scale(candidates, observations)) / _SPREAD
    tilt = 1.0 - linear[1, 1] / np.linalg.norm(linear[1])
    cost = strain / len(rows) + motion[rows, assigned].mean()
    cost += 0.5 * size**2 + _UPRIGHT * tilt + _NAMED * name_disagreement(carried, observations)
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


def predicted_by_others(
    candidates: CandidateVertices, observations: Observations, registration: Registration
) -> tuple[FloatArray, FloatArray]:
    """Return where each marker is by the places of all others: (M, 3) [m] from the centre, (M,).

    The second is the variance of a coordinate [m^2]. Leave-one-out residuals of the Gaussian
    process of the bend (C. E. Rasmussen, C. K. I. Williams, "Gaussian Processes for Machine
    Learning", 2006, eq. 5.12).
    """
    carried = observations.neutral @ registration.linear + registration.offset
    trust = _trust(registration.marker_costs)
    noise = SHAPE_ERROR**2 * (0.5 * candidates.size) ** 2 / trust
    inverse = np.linalg.inv(_bends(carried, candidates, observations) + np.diag(noise))
    points = candidates.points[registration.assigned]
    variance = 1.0 / np.diagonal(inverse)
    return points - (inverse @ (points - carried)) * variance[:, None], variance


def _bends(
    carried: FloatArray, candidates: CandidateVertices, observations: Observations
) -> FloatArray:
    """Return the prior covariance of the bend at markers (M, 3) [m]: (M, M) [m^2]."""
    width = candidates.size * (_BEND_WIDTH if observations.named is None else _NAMED_BEND_WIDTH)
    return np.asarray(
        (_BEND * candidates.size) ** 2
        * np.exp(-_squared_distances(carried, carried) / (2.0 * width**2))
    )


def name_disagreement(carried: FloatArray, observations: Observations) -> float:
    """Return 1 - the correlation of height on the face and height by name; 0 without names.

    `carried` (M, 3) are neutral markers in the character's space.
    """
    known = ~np.isnan(observations.heights)
    if not known.any():
        return 0.0
    return 1.0 - float(np.corrcoef(carried[known, 1], observations.heights[known])[0, 1])


def _trust(costs: FloatArray) -> FloatArray:
    """Return the weights (M,) of markers in Student-t fits, by their costs."""
    return np.asarray(1.0 / (1.0 + costs / _DEGREES_OF_FREEDOM))


def _squared_distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return squared distances between (M, 3) and (N, 3): (M, N)."""
    total = (a**2).sum(axis=1)[:, None] - 2.0 * a @ b.T + (b**2).sum(axis=1)
    return np.asarray(total.clip(min=0.0))


def _scale(linear: FloatArray) -> float:
    return float(np.cbrt(abs(np.linalg.det(linear))))


def _soft_targets(
    candidates: CandidateVertices, total: FloatArray, assigned: IntArray, *, fixed: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the expected point (M, 3) and offsets (S, M, 3) of each marker over its candidates.

    By their squared errors `total` (M, N); `fixed` markers are on the `assigned` one alone.
    """
    share = np.exp(-0.5 * (total - total.min(axis=1, keepdims=True)))
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
    """Return displacements that make carried markers (M, 3) the mirror images of their partners.

    Performers wear markers in pairs, or on the middle line: two are partners where each is the
    nearest to the other's mirror image.
    """
    apart = _squared_distances(points, points * [-1.0, 1.0, 1.0])
    partner = apart.argmin(axis=1)
    mutual = partner[partner] == np.arange(len(points))
    mutual &= apart.min(axis=1) < (_PAIRED * candidates.size) ** 2
    middle = 0.5 * (points + points[partner] * [-1.0, 1.0, 1.0])
    return np.where(mutual[:, None], middle - points, 0.0)


def _peak_motion(
    targets: _Targets,
    moves: FloatArray,
    visible: BoolArray,
    *,
    start: Registration,
    clipped: bool,
) -> tuple[FloatArray, FloatArray]:
    """Solve weights (K, S) and small rigid motions (K, 6) of the peak frames for given vertices.

    `moves` (K, M, 3) are in the character's space; where not `visible` the prediction of `start`
    stands in.
    """
    count, root = len(moves), np.sqrt(targets.trust)[:, None]
    shapes = (targets.offsets * root).reshape(len(targets.offsets), -1)
    rigid = (infinitesimal_motions(targets.points) * root).reshape(6, -1)
    predicted = start.weights @ shapes + start.rigid @ rigid
    observed = np.where(np.repeat(visible, 3, axis=1), (moves * root).reshape(count, -1), predicted)
    columns = np.linalg.qr(rigid.T)[0]
    free = shapes - (shapes @ columns) @ columns.T
    normal = free @ free.T
    unit = float(np.abs(targets.points).max())
    ridge = _WEIGHT_PRIOR * len(targets.points) * (MOTION_ERROR * unit) ** 2
    normal += (ridge + 1e-9 * np.trace(normal) / len(normal)) * np.eye(len(normal))
    right = observed @ free.T
    if clipped:
        weights = np.linalg.solve(normal, right.T).T.clip(0.0, 1.0)
    else:
        weights = solve_bounded(normal, right)
    motions = np.linalg.lstsq(rigid.T, (observed - weights @ shapes).T, rcond=None)[0].T
    return np.asarray(weights), np.asarray(motions)
