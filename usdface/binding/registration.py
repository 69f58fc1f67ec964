"""Anonymous markers onto the skin of a rig, by their shape and their motion together.

Unknown are where the performer's face lies in space, how it differs from the character's, what
the rig does in each peak frame, and which vertex each marker sits on. Given three of these the
fourth is a small least-squares problem, so they take turns: iterated closest points (Besl and
McKay 1992) with soft assignments (Granger and Pennec 2002), where closeness counts place *and*
motion. A vertex is close to a marker when it lies there and the rig can move it so. This finds
the nearest answer only; `usdface.binding.pose_search` starts it from everywhere.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.candidates import Domain, turning_motions
from usdface.binding.observations import Evidence
from usdface.retarget.bounded_least_squares import solve_bounded

__all__ = [
    "Registration",
    "against_names",
    "closeness",
    "improve",
    "scale_of",
    "unexplained_motion",
]

# Lengths are shares of the face's size, the RMS radius of its moving skin (ICT: 67 mm).
# Place error of a marker once the face is carried over and bent; error of its motion.
SHAPE_ERROR, MOTION_ERROR = 0.06, 0.02
# Difference of two faces beyond size and pose: size of a coordinate, and how wide it is.
_BEND, _BEND_WIDTH = 0.055, 0.7
# Moving markers spread like moving skin: bias and deviation of the logarithm of the ratio (mean of
# three performers each of ICT's face and the example's: -0.20 to -0.04).
_SPREAD_BIAS, _SPREAD = -0.14, 0.15
# The peak frames say as much of a marker's motion as this many independent ones.
_SAYS = 8.0
# Degrees of freedom of the heavy-tailed error: one marker off the face does not pull all.
_TAIL = 8.0
# Recorded heads are mostly upright: cost of one that is not, by 1 - cosine.
_UPRIGHT = 0.5
_ANCHOR_SAYS = 10.0
# Cost of names that say another height, by 1 - correlation.
_NAMED = 3.0
# Markers whose mirror images are nearer than this are partners [share of the face's size].
_PARTNERS = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class Registration:
    """One answer.

    Attributes
    ----------
    linear : (3, 3) float64
        Scale times rotation: row vectors of the performer's space times it are the character's.
    offset : (3,) float64 [m]
    bend : (M, 3) float64 [m]
        What the markers are moved further, smoothly.
    weights : (K, S) float64 in [0, 1]
    turns : (K, 6) float64
        What is left of the head's motion in the peak frames.
    places : (M,) int64
        Index into the domain.
    each : (M,) float64
        What the markers cost there: squared errors of place and motion.
    cost : float
        Mean over the markers, with what scale, bend and pose cost.
    """

    linear: FloatArray
    offset: FloatArray
    bend: FloatArray
    weights: FloatArray
    turns: FloatArray
    places: IntArray
    each: FloatArray
    cost: float


def scale_of(domain: Domain, evidence: Evidence) -> float:
    """Return the expected size of the character by the performer's."""
    return float(np.exp(_SPREAD_BIAS)) * domain.size / evidence.spread


def closeness(
    domain: Domain,
    evidence: Evidence,
    state: Registration,
    shape_error: float = SHAPE_ERROR,
    motion_error: float = MOTION_ERROR,
) -> tuple[FloatArray, FloatArray]:
    """Return squared errors of place and of motion for each marker and vertex: (M, N) twice.

    In units of the errors to be expected, which grow with the scale of the answer: else the
    smallest face would always fit best.
    """
    ratio = _scale(state.linear) / scale_of(domain, evidence)
    unit = domain.size * ratio
    here = evidence.rest @ state.linear + state.offset + state.bend
    place = _squares(here, domain.points) / (shape_error * unit) ** 2
    count = len(state.weights)
    told = state.weights @ domain.basis.reshape(len(domain.basis), -1)
    told += state.turns @ domain.rigid.reshape(6, -1)
    vertex = np.ascontiguousarray(told.reshape(count, -1, 3).transpose(1, 0, 2))
    marker = (evidence.moves @ state.linear).transpose(1, 0, 2)
    seen = evidence.seen.T.astype(np.float64)
    own = np.einsum("mkd,mkd,mk->m", marker, marker, seen)
    both = (marker * seen[..., None]).reshape(len(marker), -1) @ vertex.reshape(len(vertex), -1).T
    theirs = seen @ np.einsum("nkd,nkd->kn", vertex, vertex)
    motion = (own[:, None] - 2.0 * both + theirs).clip(min=0.0)
    motion *= _SAYS / np.maximum(seen.sum(axis=1), 1.0)[:, None] / (motion_error * unit) ** 2
    # Heavy tails: what the rig cannot do anywhere shall not send a marker anywhere.
    return place, _TAIL * np.log1p(motion / _TAIL)


def unexplained_motion(domain: Domain, evidence: Evidence, state: Registration) -> float:
    """Return what the rig leaves of the markers' motion at their places, the median marker's.

    In units of the error to be expected. The rig's weights are 0 or more, so a rest that is
    none, with an open mouth say, leaves more: the way back to the true one cannot be gone.
    """
    trust = 1.0 / (1.0 + state.each / _TAIL)
    basis, target = domain.basis[:, state.places], domain.points[state.places]
    moves = evidence.moves @ state.linear
    weights, turns = _moved(moves, evidence.seen, basis, target, trust, state, False)
    told = weights @ basis.reshape(len(basis), -1)
    told += turns @ turning_motions(target).reshape(6, -1)
    off = ((moves - told.reshape(moves.shape)) ** 2).sum(axis=2)
    seen = np.maximum(evidence.seen.sum(axis=0), 1)
    each = (off * evidence.seen).sum(axis=0) / seen
    return float(np.median(each)) / (MOTION_ERROR * domain.size) ** 2


def _squares(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return squared distances between (M, 3) and (N, 3): (M, N)."""
    total = (a**2).sum(axis=1)[:, None] - 2.0 * a @ b.T + (b**2).sum(axis=1)
    return np.asarray(total.clip(min=0.0))


def _scale(linear: FloatArray) -> float:
    return float(np.cbrt(abs(np.linalg.det(linear))))


def improve(
    domain: Domain,
    evidence: Evidence,
    state: Registration,
    shape_error: float = SHAPE_ERROR,
    motion_error: float = MOTION_ERROR,
    *,
    soft: bool = True,
    rough: bool = False,
) -> Registration:
    """Assign markers to vertices, then fit face and weights to what is assigned.

    `soft` spreads a marker over all the vertices it may sit on; `rough` clips the weights
    instead of solving for them.
    """
    place, motion = closeness(domain, evidence, state, shape_error, motion_error)
    total = place + motion
    fixed = evidence.anchors >= 0
    rows = np.arange(len(total))
    nearest = total.argmin(axis=1)
    nearest[fixed] = np.searchsorted(domain.places, evidence.anchors[fixed])
    each = total[rows, nearest]
    trust = np.where(fixed, _ANCHOR_SAYS, 1.0 / (1.0 + each / _TAIL))
    if soft:
        target, basis = _shared(domain, total, nearest, fixed)
    else:
        target, basis = domain.points[nearest], domain.basis[:, nearest]
    linear, offset = _carry(evidence.rest, target, trust)
    carried = evidence.rest @ linear + offset
    bends = (_BEND * domain.size) ** 2 * np.exp(
        -_squares(carried, carried) / (2.0 * (_BEND_WIDTH * domain.size) ** 2)
    )
    noise = (0.5 * domain.size) ** 2 / trust
    pull = np.linalg.solve(bends + np.diag(shape_error**2 * noise), target - carried)
    weights, turns = _moved(
        evidence.moves @ linear, evidence.seen, basis, target, trust, state, rough
    )
    bend = bends @ pull
    if soft:
        bend = bend + _towards_mirror(carried + bend, domain)
    rest = target - carried
    strain = (rest * np.linalg.solve(bends + np.diag(SHAPE_ERROR**2 * noise), rest)).sum()
    size = np.log(_scale(linear) / scale_of(domain, evidence)) / _SPREAD
    tilt = 1.0 - linear[1, 1] / np.linalg.norm(linear[1])
    cost = strain / len(rows) + motion[rows, nearest].mean()
    cost += 0.5 * size**2 + _UPRIGHT * tilt + _NAMED * against_names(carried, evidence)
    return replace(
        state,
        linear=linear,
        offset=offset,
        bend=bend,
        weights=weights,
        turns=turns,
        places=nearest,
        each=each,
        cost=float(cost),
    )


def _shared(
    domain: Domain, total: FloatArray, nearest: IntArray, fixed: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the point (M, 3) and motions (S, M, 3) of each marker, of all vertices it may be on.

    By the cost `total` (M, N) of each; `fixed` markers are on the `nearest` alone.
    """
    share = np.exp(-0.5 * (total - total.min(axis=1, keepdims=True)))
    share[fixed] = 0.0
    share[np.flatnonzero(fixed), nearest[fixed]] = 1.0
    share /= share.sum(axis=1, keepdims=True)
    flat = domain.basis.transpose(1, 0, 2).reshape(len(domain.points), -1)
    basis = (share @ flat).reshape(len(total), -1, 3)
    return share @ domain.points, basis.transpose(1, 0, 2)


def _carry(
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


def against_names(carried: FloatArray, evidence: Evidence) -> float:
    """Return 1 - the correlation of height on the face and height by name; 0 without names."""
    known = ~np.isnan(evidence.heights)
    if not known.any():
        return 0.0
    return 1.0 - float(np.corrcoef(carried[known, 1], evidence.heights[known])[0, 1])


def _towards_mirror(points: FloatArray, domain: Domain) -> FloatArray:
    """Return what would make carried markers (M, 3) the mirror image of their partners.

    Performers wear markers in pairs, or on the middle line: where each of two is the nearest
    to the other's mirror image they are partners.
    """
    apart = _squares(points, points * [-1.0, 1.0, 1.0])
    partner = apart.argmin(axis=1)
    mutual = partner[partner] == np.arange(len(points))
    mutual &= apart.min(axis=1) < (_PARTNERS * domain.size) ** 2
    middle = 0.5 * (points + points[partner] * [-1.0, 1.0, 1.0])
    return np.where(mutual[:, None], middle - points, 0.0)


def _moved(
    moves: FloatArray,
    seen: BoolArray,
    basis: FloatArray,
    target: FloatArray,
    trust: FloatArray,
    state: Registration,
    rough: bool,
) -> tuple[FloatArray, FloatArray]:
    """Solve weights and small rigid motions of the peak frames for given places."""
    count, root = len(moves), np.sqrt(trust)[:, None]
    shapes = (basis * root).reshape(len(basis), -1)
    rigid = (turning_motions(target) * root).reshape(6, -1)
    told = state.weights @ shapes + state.turns @ rigid
    observed = np.where(np.repeat(seen, 3, axis=1), (moves * root).reshape(count, -1), told)
    columns = np.linalg.qr(rigid.T)[0]
    free = shapes - (shapes @ columns) @ columns.T
    normal = free @ free.T
    # As if a weight were about 0.4: keeps what hardly shows at rest.
    unit = float(np.abs(target).max())
    ridge = 0.2 * len(target) * (MOTION_ERROR * unit) ** 2
    normal += (ridge + 1e-9 * np.trace(normal) / len(normal)) * np.eye(len(normal))
    right = observed @ free.T
    if rough:
        weights = np.linalg.solve(normal, right.T).T.clip(0.0, 1.0)
    else:
        weights = solve_bounded(normal, right)
    turns = np.linalg.lstsq(rigid.T, (observed - weights @ shapes).T, rcond=None)[0].T
    return np.asarray(weights), np.asarray(turns)
