"""Takes of other people: the ICT face's identity modes make performers whose weights are known.

A performer is the neutral plus a weighted sum of identity modes; the shapes are carried over by
deformation transfer, each made stronger or weaker where the row says so. Recorded curves drive the
performer; 68 landmarks with noise and a moving head are the take, 30 neutral frames before it.
Everything random is drawn from the performer's own number, so that a table can be made again.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from benchmarks.performers.deformation_transfer import transfer
from benchmarks.solve.faces import ict
from benchmarks.solve.worlds import nodding
from usdface.arrays import FloatArray, IntArray

__all__ = [
    "BUILT_WITH",
    "JUDGED_ON",
    "NEUTRAL_FRAMES",
    "OTHER_TAKE",
    "ROWS",
    "SCORED",
    "SKIN",
    "Performance",
    "Row",
    "perform",
    "strengths_of",
    "to_extremes",
]

# Performers that were looked at while the solve was made, and those looked at once, at the end.
BUILT_WITH, JUDGED_ON = (1, 2, 3, 4), (5, 6, 7, 8)
NEUTRAL_FRAMES = 30
NOISE = 3e-4  # m
# Vertices of the ICT model's face and neck: skin, no eyes, teeth and sockets.
SKIN = 9409
# Settings of the solve were found on the first half of the recorded curves. It is the other take of
# a performer; the second half is scored.
OTHER_TAKE, SCORED = slice(0, 2015), slice(2015, 4030)
# In a range of motion each shape goes to 1 for so many frames, but for those that the recording
# moves by less than this.
_HELD, _MOVED = 3, 0.25


@dataclass(frozen=True, slots=True)
class Row:
    """Conditions of a performance.

    Attributes
    ----------
    name : str
    strengths : bool
        Each shape is 0.8 to 1.25 as strong as the character's.
    misplaced : float [m]
        Distance along the skin between a marker and the vertex that it is bound to.
    part : (int, int)
        First frame of the recorded curves, and the one after the last.
    cut_off : float [Hz]
        Of the Butterworth filter (second order, forwards and backwards) that the markers went
        through before they were exported, as most do; 0 = none.
    """

    name: str
    strengths: bool = False
    misplaced: float = 0.0
    part: tuple[int, int] = (SCORED.start, SCORED.stop)
    cut_off: float = 0.0


ROWS = (
    Row("another person"),
    Row("strengths", True),
    Row("places off by 4 mm", misplaced=0.004),
    Row("another person, 10 s", part=(2915, 3215)),
    Row("another person, 10 s, filtered at 6 Hz", part=(2915, 3215), cut_off=6.0),
)


@dataclass(frozen=True, eq=False, slots=True)
class Performance:
    """A take of another person, and the answer.

    Attributes
    ----------
    positions : (30 + F, M, 3) float64 [m]
        With noise and a moving head.
    still : (30 + F, M, 3) float64 [m]
        The same without the head's motion: what other solvers are given.
    truth : (F, S) float64
    bound : (M,) int64
        Vertices of the character that markers are bound to.
    worn : (M,) int64
        Vertices of the performer that they sit on.
    neutral : (M, 3) float64 [m]
        Of the performer, without noise.
    offsets : (S, M, 3) float64 [m]
        Of the performer's shapes at the markers.
    neutral_frames : int
        Before the performance.
    other, range_of_motion : Performance or None
        Other takes of this performer, of which a performer's file is made: the other half of the
        curves as recorded, and stretched so that each movement goes to its extreme.
    """

    positions: FloatArray
    still: FloatArray
    truth: FloatArray
    bound: IntArray
    worn: IntArray
    neutral: FloatArray
    offsets: FloatArray
    neutral_frames: int
    other: "Performance | None" = None
    range_of_motion: "Performance | None" = None


def perform(
    data: Path,
    number: int,
    row: Row,
    *,
    part: slice | None = None,
    extremes: bool = False,
    noise: float = NOISE,
    neutral_frames: int = NEUTRAL_FRAMES,
    shown: FloatArray | None = None,
    markers: IntArray | None = None,
) -> Performance:
    """Let performer `number` perform a part of the recorded curves, or stretched to extremes.

    Without a part it is that of the row, and there are other takes. The neutral frames show
    weights `shown` (S,), or nothing. `markers` (M,) are vertices; by default 68 landmarks.
    """
    other = range_of_motion = None
    if part is None:
        part = slice(*row.part)
        other, range_of_motion = (
            perform(
                data,
                number,
                row,
                part=OTHER_TAKE,
                extremes=stretched,
                noise=noise,
                neutral_frames=neutral_frames,
            )
            for stretched in (False, True)
        )
    face = ict(data)
    neutral, offsets = _performer(data, number)
    rng = np.random.default_rng(1000 + number)
    strengths = strengths_of(number, len(offsets)) if row.strengths else np.ones(len(offsets))
    bound = face.points if markers is None else markers
    worn = bound
    if row.misplaced:
        worn = _beside(_graph(data), bound, row.misplaced, rng)
    truth = to_extremes(face.curves[part]) if extremes else face.curves[part]
    moved = strengths[:, None, None] * offsets[:, worn]
    rest = np.zeros(truth.shape[1]) if shown is None else shown
    played = np.concatenate([np.tile(rest, (neutral_frames, 1)), truth])
    still = neutral[worn] + np.tensordot(played, moved, 1)
    jitter = np.random.default_rng([number, part.start or 0]).normal(size=still.shape)
    positions, unturned = nodding(still, face.rate) + noise * jitter, still + noise * jitter
    if row.cut_off:
        cut = butter(2, row.cut_off / (0.5 * face.rate))
        positions, unturned = (filtfilt(*cut, each, axis=0) for each in (positions, unturned))
    return Performance(
        positions,
        unturned,
        truth,
        bound,
        worn,
        neutral[worn],
        moved,
        neutral_frames,
        other,
        range_of_motion,
    )


def to_extremes(curves: FloatArray) -> FloatArray:
    """Stretch recorded curves (F, S) so that each shape goes to 1: a range of motion."""
    curves = curves.clip(0, 1)
    top = np.sort(curves, axis=0)[-_HELD]
    return np.asarray((curves / np.where(top > _MOVED, top, 1.0)).clip(0, 1))


def strengths_of(number: int, count: int) -> FloatArray:
    """Return how strong each of `count` shapes of a performer is, by the character's: (S,)."""
    return np.random.default_rng(1000 + number).uniform(0.8, 1.25, count)


@cache
def _performer(data: Path, number: int) -> tuple[FloatArray, FloatArray]:
    """Return neutral (V, 3) and shape offsets (S, V, 3) of the performer's skin [m]."""
    mesh = ict(data).mesh
    packed = np.load(data / "ict_identities" / "identity_offsets.npz")
    modes = 0.01 * np.stack([packed[name][:SKIN] for name in sorted(packed)]).astype(np.float64)
    rng = np.random.default_rng(number)
    weights = rng.uniform(1, 3, len(modes)) * rng.choice([-1, 1], len(modes))
    neutral = mesh.points[:SKIN] + np.tensordot(weights, modes, 1)
    size = rng.uniform(0.9, 1.1)
    offsets = mesh.offsets_at(np.arange(SKIN))
    moved = transfer(mesh.points[:SKIN], neutral, _triangles(data), offsets)
    return size * neutral, size * moved


def _triangles(data: Path) -> IntArray:
    mesh = ict(data).mesh
    first = np.cumsum(mesh.face_counts) - mesh.face_counts
    quads = first[mesh.face_counts == 4]
    corners = np.concatenate([first[:, None] + [0, 1, 2], quads[:, None] + [0, 2, 3]])
    triangles = mesh.face_indices[corners]
    return np.asarray(triangles[(triangles < SKIN).all(axis=1)])


def _graph(data: Path) -> csr_matrix:
    """Return the lengths of the skin's edges [m], so that lips and lids are no shortcut."""
    points, triangles = ict(data).mesh.points[:SKIN], _triangles(data)
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    return csr_matrix((lengths, edges.T), (SKIN, SKIN))


def _beside(
    graph: csr_matrix, vertices: IntArray, distance: float, rng: np.random.Generator
) -> IntArray:
    """Return a vertex at that distance along the skin from each vertex, to a random side."""
    lengths = dijkstra(graph, directed=False, indices=vertices, limit=1.5 * distance)
    off = np.abs(lengths - distance)
    near = [np.flatnonzero(row <= max(0.15 * distance, row.min())) for row in off]
    return np.array([rng.choice(candidates) for candidates in near])
