"""Weights at which the character's lips are as near to each other as the performer's.

Only lips that nearly touch are held together. Weights that part them are lowered, as little as
possible; where the jaw is open, the shape that closes the lips over it comes up as well.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.evaluator import BlendShapeEvaluator, shape_places
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.closure.lip_limits import WIDENS
from usdface.face.bound_face import BoundFace
from usdface.face.known_limits import with_known_limits
from usdface.numerics.frame_blocks import by_blocks

__all__ = ["LipApertures", "as_open_as_seen", "lip_apertures_of", "touching_lips"]

# Places along the lips.
_PLACES = 6
_HALVINGS = 20  # of the part of a closure that is done
# Rounds of projections: an upper bound. They aim so far inside the limits [m] that they end.
_ROUNDS = 60
_INSIDE = 1e-5
# The part of its weights that the lips are brought to for the slopes of a round: near, as those of
# a bent way change on it. By hand.
_SHORT = 0.9
# Frames at a time; no result depends on it. Slopes of 6 apertures by 270 blend shapes have 3 MB.
_BLOCK = 256


@dataclass(frozen=True, eq=False)
class LipApertures:
    """The apertures between the lips at K places, for weights of T blend shapes.

    Attributes
    ----------
    neutral : (K,) float64 [m]
        On the neutral face, where the lips touch.
    x : (K,) float64 [m]
        Of the places, rising.
    across : (3,) float64
        Unit vector from the lower to the upper lip.
    evaluator : BlendShapeEvaluator
        By how much the shapes change the apertures: N = K.
    """

    neutral: FloatArray
    x: FloatArray
    across: FloatArray
    evaluator: BlendShapeEvaluator

    def __post_init__(self) -> None:
        freeze(self, "neutral", "x", "across")

    def opened(self, weights: FloatArray) -> FloatArray:
        """Return by how much the lips are open at weights (F, T): (F, K) [m]."""
        return np.asarray(self.evaluator.displacements(self.evaluator.combined(weights)))


def lip_apertures_of(face: BoundFace, names: tuple[str, ...]) -> LipApertures | None:
    """Measure the lips of a face; None if its layout has none."""
    mesh, lips = face.mesh, face.layout.lips
    if not len(lips):
        return None
    upper, lower = mesh.points[lips[:, 0]], mesh.points[lips[:, 1]]
    direction = (upper - lower).sum(axis=0)
    across = direction / max(float(np.linalg.norm(direction)), 1e-12)
    shares, x = _places((upper[:, 0] + lower[:, 0]) / 2)

    def apertures(values: FloatArray) -> FloatArray:
        both = values.reshape(*values.shape[:-1], 2, len(lips), 3)
        return np.asarray(((both[..., 0, :, :] - both[..., 1, :, :]) @ across) @ shares)

    vertices = lips.T.ravel()
    evaluator = with_known_limits(evaluator_of(mesh.shapes, vertices)[0], mesh.shape_names)
    neutral = apertures(mesh.points[vertices].reshape(-1))
    evaluator = evaluator.mapped(apertures).reordered(shape_places(names, mesh.shape_names))
    return LipApertures(neutral, x, across, evaluator)


def touching_lips(weights: FloatArray, largest: FloatArray, apertures: LipApertures) -> FloatArray:
    """Return weights at which no aperture of the lips exceeds its limit.

    Parameters
    ----------
    weights : (F, T) float64
    largest : (F, K) float64 [m]
        The limits.
    apertures : LipApertures

    Returns
    -------
    (F, T) float64
        Equal to `weights` in frames in which no aperture exceeds its limit.
    """

    def touching(block: slice) -> FloatArray:
        result, limit = weights[block].copy(), largest[block]
        for _ in range(_ROUNDS):
            frames = np.flatnonzero((apertures.opened(result) > limit).any(axis=1))
            if not len(frames):
                break
            result[frames] = _nearer(result[frames], limit[frames], apertures)
        return result

    return by_blocks(len(weights), touching, _BLOCK)


def as_open_as_seen(
    weights: FloatArray,
    closed: FloatArray,
    largest: FloatArray,
    seen: FloatArray,
    apertures: LipApertures,
    tolerance: float,
    *,
    solved: FloatArray,
) -> FloatArray:
    """Return the part of a closure after which the lips are as near as the markers show overall.

    A shape that closes one place closes others, too: a corner of the mouth that touches is no
    reason to close a mouth that is open in the middle. The part is that of the least squares of how
    much wider places are than they may be, and how much narrower than they are seen.

    Parameters
    ----------
    weights, closed : (F, T) float64
        Before the closure, and after.
    largest, seen : (F, K) float64 [m]
        The limits, and `LipDistances.seen`.
    apertures : LipApertures
    tolerance : float [m]
        Of a contact.
    solved : (F, K) float64 [m]
        By how much the lips are open as solved: places that a first closure brought nearer than
        they are seen count as too narrow in a second one, too, which would else do a further part.
    """
    before, after = apertures.opened(weights), apertures.opened(closed)
    beyond = np.maximum(seen - tolerance, 0.0)
    open_by = beyond**2 / (beyond + WIDENS * tolerance)
    at_first = np.maximum(before, solved)
    least = np.where(beyond > 0.0, np.minimum(at_first, open_by), -np.inf)
    frames = np.flatnonzero((after < least).any(axis=1))
    low, high = np.zeros(len(frames)), np.ones(len(frames))
    start, way = before[frames], (before - after)[frames]
    for _ in range(_HALVINGS):
        part = (low + high) / 2
        opened = start - part[:, None] * way
        wide = np.maximum(opened - largest[frames], 0.0)
        narrow = np.maximum(least[frames] - opened, 0.0)
        further = (way * (wide - narrow)).sum(axis=1) > 0.0
        low, high = np.where(further, part, low), np.where(further, high, part)
    result = closed.copy()
    result[frames] = weights[frames] + high[:, None] * (closed[frames] - weights[frames])
    return result


def _nearer(weights: FloatArray, largest: FloatArray, apertures: LipApertures) -> FloatArray:
    """Project weights on the limit of each aperture; each weight gets its largest change."""
    over = apertures.opened(weights) - largest
    over[over > 0] += _INSIDE
    slopes, whole = _slopes(weights, apertures, _SHORT), _slopes(weights, apertures, 0.0)
    change = np.zeros(weights.shape)
    for k in np.flatnonzero((over > 0).any(axis=0)):
        along = _useful(slopes[:, :, k], weights, apertures)
        along = _with_detours(along, whole[:, :, k], weights, over[:, k])
        size = (along**2).sum(axis=1)
        step = np.divide(
            over[:, k], size, out=np.zeros(len(size)), where=(size > 0) & (over[:, k] > 0)
        )
        wanted = -step[:, None] * along
        change = np.where(np.abs(wanted) > np.abs(change), wanted, change)
    closed = weights + change
    return _limited(np.maximum(closed, 0.0), weights, apertures)


def _slopes(weights: FloatArray, apertures: LipApertures, part: float) -> FloatArray:
    """Return the slope of each aperture by each weight, on the way to a part of all weights.

    Returns
    -------
    (F, T, K) float64 [m]
    """
    evaluator = apertures.evaluator
    if evaluator.linear:
        return np.broadcast_to(evaluator.offsets, (len(weights), *evaluator.offsets.shape))
    result = np.zeros((len(weights), *evaluator.offsets.shape))
    ends = evaluator.combined(weights), evaluator.combined(part * weights)
    result[:, evaluator.free] = evaluator.secants(*ends)
    return result


def _useful(slopes: FloatArray, weights: FloatArray, apertures: LipApertures) -> FloatArray:
    """Return the slopes (F, T) of the weights that can bring the lips together."""
    opens = (slopes > 0) & (weights > 0)
    closes = np.zeros(weights.shape, dtype=bool)
    for low, high in apertures.evaluator.limits.tolist():
        closes[:, low] = (slopes[:, low] < 0) & (weights[:, low] < weights[:, high])
    return np.where(opens | closes, slopes, 0.0)


def _with_detours(
    along: FloatArray, whole: FloatArray, weights: FloatArray, over: FloatArray
) -> FloatArray:
    """Return useful slopes (F, T), also of weights that first part the lips on their way to 0.

    An inbetween can open the lips further than the whole shape does. Such a weight is lowered by
    the slope of its whole way to 0, but only where the others at 0 leave an aperture too wide.

    Parameters
    ----------
    along : (F, T) float64
        The slopes of the weights that bring the lips together at once; of others 0.
    whole : (F, T) float64
        Slopes on the way to 0.
    weights : (F, T) float64
    over : (F,) float64
        By how much the aperture is too wide.
    """
    left = over - (np.maximum(along, 0.0) * weights).sum(axis=1)
    detour = (along == 0) & (whole > 0) & (weights > 0) & (left > 0)[:, None]
    return np.where(detour, whole, along)


def _limited(closed: FloatArray, weights: FloatArray, apertures: LipApertures) -> FloatArray:
    """Limit shapes that close the lips of an open jaw to the jaw's weight, or their own before."""
    result = closed.copy()
    for low, high in apertures.evaluator.limits.tolist():
        highest = np.maximum(result[:, high], np.minimum(weights[:, low], result[:, low]))
        result[:, low] = np.minimum(result[:, low], highest)
    return result


def _places(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the share of each pair in each place along the lips (P, K), and x of the places."""
    edges = np.linspace(x.min(), x.max(), _PLACES + 1)
    place: IntArray = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _PLACES - 1)
    shares = (place[:, None] == np.unique(place)).astype(np.float64)
    shares /= shares.sum(axis=0)
    return shares, np.asarray(x @ shares)
