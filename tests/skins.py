"""Small skins for places of markers: a flat one, two lips joined at a corner, a smooth head."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.marker_surface import MarkerSurface
from usdface.rigs import BlendShape, Mesh

__all__ = ["LIP", "STEP", "Head", "flat_skin", "grid", "joined_lips", "make_head"]

STEP, LIP = 0.004, 31
FRAMES = 120
RATE = 30.0


@dataclass(frozen=True, eq=False)
class Head:
    """A smooth head, 36 markers on it, and a performance (F, S) of its shapes."""

    mesh: Mesh
    vertices: IntArray
    weights: FloatArray

    @property
    def surface(self) -> MarkerSurface:
        return MarkerSurface(self.mesh, self.vertices)

    @property
    def points(self) -> FloatArray:
        return np.asarray(self.mesh.points[self.vertices])

    @property
    def times(self) -> FloatArray:
        return np.arange(len(self.weights)) / RATE

    def performed(self, shifts: FloatArray) -> FloatArray:
        """Return the markers (F, M, 3) that sit beside their vertices by `shifts` (M, 3)."""
        placed = self.surface.at(shifts)
        moved = placed.evaluator.displacements(self.weights)
        return np.asarray(placed.points + moved.reshape(len(moved), -1, 3))

    def beside(self, size: float, seed: int) -> FloatArray:
        """Return shifts (M, 3) at random along the skin, of RMS length `size` [m]."""
        drawn = np.random.default_rng(seed).normal(size=(len(self.vertices), 2))
        tangents = self.surface.at(np.zeros((len(self.vertices), 3))).tangents
        return np.asarray(size / np.sqrt(2) * np.einsum("ma,mad->md", drawn, tangents))


def grid(columns: int, rows: int) -> tuple[FloatArray, IntArray]:
    """Return columns and rows (V, 2) of a grid's vertices, and its quads (P, 4)."""
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.stack([first, first + 1, first + columns + 1, first + columns], axis=1)
    return np.stack([column, row], axis=-1).reshape(-1, 2).astype(float), quads


def flat_skin(shapes: tuple[BlendShape, ...] = (), columns: int = 15, rows: int = 13) -> Mesh:
    """Return a plane through the origin, askew, with a vertex every 4 mm."""
    places, quads = grid(columns, rows)
    axes = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 2)))[0].T
    points = STEP * (places - places.mean(axis=0)) @ axes
    return Mesh("skin", points, np.full(len(quads), 4), quads.ravel(), shapes=shapes)


def joined_lips(gap: float = 1e-4) -> Mesh:
    """Return two lips, `gap` apart, joined at their left end; "open" moves the lower one.

    Six rows of `LIP` vertices, every 2 mm; the upper three rows are the upper lip.
    """
    places, quads = grid(LIP, 6)
    x, y = 0.002 * (places - [0.0, 2.5]).T
    points = np.column_stack([x, y - np.sign(y) * (0.001 - gap / 2), np.zeros(len(x))])
    between = (quads[:, 0] // LIP == 2) & (quads[:, 0] % LIP > 0)
    kept = quads[~between]
    below = np.arange(len(points)) < 3 * LIP
    opening = BlendShape.from_dense("open", below[:, None] * np.array([0.0, -0.01, 0.0]))
    return Mesh("lips", points, np.full(len(kept), 4), kept.ravel(), shapes=(opening,))


def make_head() -> Head:
    """Make it: 14 smooth shapes that overlap, and each on its own beat."""
    places, quads = grid(37, 41)
    u, v = (places / [18, 20] - 1).T
    depth = 0.09 * (1 - 0.6 * u**2 - 0.3 * v**2)
    points = np.stack([0.072 * u, 0.08 * v, depth], axis=1)
    rng = np.random.default_rng(6)
    centres = np.array([[a, b] for a in (-0.6, 0.0, 0.6) for b in (-0.7, -0.25, 0.2, 0.65)])
    centres = np.concatenate([centres, [[-0.3, -0.5], [0.3, -0.5]]])
    shapes = []
    for number, centre in enumerate(centres):
        near = np.exp(-((np.stack([u, v], 1) - centre) ** 2).sum(axis=1) / 0.35**2)
        move = rng.normal(size=3) * [0.005, 0.008, 0.003]
        shapes.append(BlendShape(f"s{number}", np.arange(len(points)), near[:, None] * move))
    mesh = Mesh("head", points, np.full(len(quads), 4), quads.ravel(), shapes=tuple(shapes))
    row, column = np.meshgrid(np.arange(3, 41, 7), np.arange(3, 37, 6), indexing="ij")
    vertices = (row * 37 + column).ravel()
    beat = rng.uniform(1.0, 5.0, len(shapes))
    phase = rng.uniform(0, 2 * np.pi, len(shapes))
    times = np.arange(FRAMES)[:, None] / RATE
    weights = np.clip(0.4 + 0.6 * np.sin(times * beat + phase), 0.0, 1.0)
    weights[:10] = 0.0
    weights[10:20] *= np.linspace(0.0, 1.0, 10)[:, None]
    return Head(mesh, vertices, weights)
