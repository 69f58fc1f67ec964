"""Contact: a correction opens no closed mouth or eye, and pushes no lid or lip into the other.

The gap of a seam (`usdface.face.lip_lid_contacts`) is measured at a few places along it, each the
mean of its pairs of vertices, across the seam: linear in the weights. Where a gap would change by
more than it may, what changes it is taken back, as little as possible (least squares, in closed
form but for the number of weights that end at 0), in all frames at once.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, frozen
from usdface.errors import InputError
from usdface.face.layout import FaceParts
from usdface.rigs import Mesh

__all__ = ["Gaps", "gaps_of", "hold"]

# Places along the lips, and along each eye. Chosen by hand, no experiment (docs/constants.md).
_PLACES = {"lips": 6, "lids": 4}
# What is already open may open further by this much of its opening: an expression at a third of its
# strength, below the least of benchmarks/expressions.py (40 %), is raised to the whole by 2.
_SLOPE = 2.0
# Limits of time: rounds, and as many steps as weights reach 0 on the way; what still exceeds the
# bounds then is scaled down.
_ROUNDS = 20
_STEPS = 12
# Numerical [m]: a five-hundredth of the default tolerance.
_EXACT = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Gaps:
    """Gaps of lips and lids at K places, signed: negative where one is inside the other.

    Attributes
    ----------
    seam : tuple of str, length K
        "lips", "left lids", "right lids".
    neutral : (K,) float64 [m]
        On the neutral face.
    moves : (T, K) float64 [m]
        By each blend shape at weight 1.
    touch : (K,) float64 [m]
        At which they touch: lips as they rest, lids as the shape that closes them leaves them.
    floor : (K,) float64 [m]
        To which a correction may close them: as the rig's own expressions press them.
    tolerance : float [m]
    """

    seam: tuple[str, ...]
    neutral: FloatArray
    moves: FloatArray
    touch: FloatArray
    floor: FloatArray
    tolerance: float

    def __post_init__(self) -> None:
        for name in ("neutral", "moves", "touch", "floor"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def at(self, weights: FloatArray) -> FloatArray:
        """Return the gaps at some weights (F, T): (F, K) [m]."""
        return np.asarray(self.neutral + weights @ self.moves)

    def room(self, solved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return by how much a correction may close and open gaps (F, K): (F, K) each [m].

        What touches moves by the tolerance. What is open may close until it touches, and open
        further in proportion; what is pressed may let go.
        """
        ajar = np.maximum(solved - self.touch - self.tolerance, 0.0)
        pressed = np.maximum(self.touch - solved, 0.0)
        close = np.maximum(solved - self.floor, 0.0)
        return -self.tolerance - close, self.tolerance + pressed + _SLOPE * ajar


def gaps_of(mesh: Mesh, parts: FaceParts, names: tuple[str, ...], poses: FloatArray) -> Gaps:
    """Measure the gaps along the seams of a face.

    Parameters
    ----------
    mesh : Mesh
    parts : FaceParts
        Its pairs are of the mesh's vertices.
    names : tuple of str, length T
        Blend shapes in the order of the weights; the mesh may lack some.
    poses : (E, T) float64
        The rig's expressions.

    Raises
    ------
    InputError
        If a pair names a vertex that the mesh does not have.
    """
    pairs = np.concatenate([parts.lips, parts.lids]).reshape(-1, 2)
    outside = (pairs < 0) | (pairs >= len(mesh.points))
    if outside.any():
        raise InputError(
            f"lips or lids touch at vertex {pairs[outside][0]} of {mesh.path or mesh.name}, which "
            f"has vertices 0 to {len(mesh.points) - 1}"
        )
    order = [i for i, name in enumerate(names) if name in mesh.shape_names]
    rows = [mesh.shape_names.index(names[i]) for i in order]
    seam: list[str] = []
    neutral, moves = [np.zeros(0)], [np.zeros((len(names), 0))]
    for kind, pairs in _seams(mesh, parts):
        across = mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]]
        way = across.sum(axis=0)
        way /= max(float(np.linalg.norm(way)), 1e-12)
        offsets = mesh.offsets_at(pairs[:, 0]) - mesh.offsets_at(pairs[:, 1])
        places = _places(mesh.points[pairs, 0].mean(axis=1), _PLACES[kind.split()[-1]])
        mean = places / places.sum(axis=0)
        seam += [kind] * mean.shape[1]
        neutral.append((across @ way) @ mean)
        column = np.zeros((len(names), mean.shape[1]))
        column[order] = ((offsets @ way) @ mean)[rows]
        moves.append(column)
    rest, by_shape = np.concatenate(neutral), np.concatenate(moves, axis=1)
    # The margins of lids have a thickness: what the shape that closes them leaves is closed.
    closed = np.clip(rest + by_shape.min(axis=0, initial=0.0), 0.0, None)
    touch = np.where(np.array(seam, dtype=str) == "lips", rest, closed)
    pressed = (rest + poses @ by_shape).min(axis=0, initial=np.inf)
    floor = np.minimum(touch, pressed)
    return Gaps(tuple(seam), rest, by_shape, touch, floor, parts.tolerance)


def _seams(mesh: Mesh, parts: FaceParts) -> list[tuple[str, IntArray]]:
    lids = parts.lids
    x = mesh.points[lids, 0].mean(axis=1) if len(lids) else np.zeros(0)
    middle = (x.min(initial=np.inf) + x.max(initial=-np.inf)) / 2 if len(x) else 0.0
    seams = [
        ("lips", parts.lips),
        ("left lids", lids[x > middle]),
        ("right lids", lids[x <= middle]),
    ]
    return [(kind, pairs) for kind, pairs in seams if len(pairs)]


def _places(x: FloatArray, count: int) -> FloatArray:
    """Return how much each pair counts for each place along the seam: (P, K).

    A pair between two places counts for both, so that no place has an edge, and left is as right.
    """
    step = (x.max() - x.min()) / count
    if not step > 0:
        return np.ones((len(x), 1))
    centres = x.min() + step * (np.arange(count) + 0.5)
    counts = np.maximum(1.0 - np.abs(x[:, None] - centres) / step, 0.0)
    return np.asarray(counts[:, counts.any(axis=0)])


def hold(
    solved: FloatArray, corrected: FloatArray, gaps: Gaps
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Take back as little of a correction as keeps the contact of lips and lids.

    Every weight stays between the solved and the corrected one.

    Parameters
    ----------
    solved, corrected : (F, T) float64
    gaps : Gaps

    Returns
    -------
    held : (F, T) float64
        Equal to `corrected` where the contact is kept anyway.
    limited : (F, K) bool
        Where a gap would have changed by more than it may ...
    excess : (F, K) float64 [m]
        ... and by how much.
    """
    before = gaps.at(solved)
    low, high = gaps.room(before)
    wanted = corrected - solved
    change = wanted @ gaps.moves
    excess = np.maximum(change - high, low - change).clip(min=0.0)
    limited = excess > _EXACT
    frames = np.flatnonzero(limited.any(axis=1))
    held = np.array(corrected)
    if len(frames):
        concerned = np.flatnonzero((wanted[frames] != 0).any(axis=0) & gaps.moves.any(axis=1))
        block = np.ix_(frames, concerned)
        room = low[frames], high[frames]
        held[block] = solved[block] + _kept(wanted[block], gaps.moves[concerned], *room)
    return held, limited, excess


def _kept(wanted: FloatArray, moves: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return d (N, S) near to `wanted`, between 0 and it, with low <= d moves <= high.

    `low` <= 0 <= `high`, (N, K): 0 is always allowed. Each place takes back what works against
    it, and a weight goes as far back as any place asks; since that only ever takes back, it
    comes to an end, and left and right are treated alike.
    """
    kept = wanted.copy()
    for _ in range(_ROUNDS):
        gap = kept @ moves
        over = np.maximum(gap - high, low - gap) > _EXACT
        if not over.any():
            break
        least = kept.copy()
        for k in np.flatnonzero(over.any(axis=0)):
            rows = np.flatnonzero(over[:, k])
            # Turned so that the gap is too wide.
            way = np.where(gap[rows, k] > 0, 1.0, -1.0)[:, None] * moves[:, k]
            most = np.where(gap[rows, k] > 0, high[rows, k], -low[rows, k])
            back = _projected(kept[rows], way, most)
            least[rows] = np.where(np.abs(back) < np.abs(least[rows]), back, least[rows])
        kept = least
    return kept * _share(kept @ moves, low, high)[:, None]


def _projected(wanted: FloatArray, way: FloatArray, most: FloatArray) -> FloatArray:
    """Take back as little as possible (least squares) of what moves a gap beyond `most` (N,).

    `way` (N, S) is the motion of the gap by each weight. Newton's steps on the one multiplier go
    up to the answer and never past it, because the gap falls ever more slowly.
    """
    part = way * wanted
    adding = part > 0
    size = np.abs(way)
    still = np.where(adding, 0.0, part).sum(axis=1)
    force = np.zeros(len(wanted))
    for _ in range(_STEPS):
        left = np.where(adding, np.maximum(np.abs(wanted) - force[:, None] * size, 0.0), 0.0)
        over = (left * size).sum(axis=1) + still - most
        slope = np.where(left > 0, size**2, 0.0).sum(axis=1)
        step = np.zeros(len(wanted))
        np.divide(over, slope, out=step, where=(over > 0) & (slope > 0))
        if not step.any():
            break
        force += step
    left = np.where(adding, np.maximum(np.abs(wanted) - force[:, None] * size, 0.0), 0.0)
    return np.where(adding, np.copysign(left, wanted), wanted)


def _share(gap: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the largest factor in [0, 1] that keeps gaps (N, K) within bounds: (N,).

    The bounds are taken as wide as is exact enough: the last bits of a gap that may not change
    must not stop all else.
    """
    room = np.where(gap > 0, high, -low) + _EXACT
    share = np.ones(gap.shape)
    np.divide(room, np.abs(gap), out=share, where=np.abs(gap) > room)
    return np.asarray(share.min(axis=1, initial=1.0))
