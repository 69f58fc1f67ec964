"""The skin under painted dots: the tracked centre of a dot moves as the mean of the skin under it.

A camera tracks the centre of a dot, not the vertex that the dot was painted around. The two differ
where skin folds or splits under the dot, as in the corners of the mouth.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, frozen
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.surface_graph import joined_at_seams
from usdface.geometry.triangulation import triangulated
from usdface.rigs import Mesh

__all__ = ["DotSkin", "dot_skin", "interpolated"]

# Triangles at the edge of a dot are cut into pieces no longer than this share of its radius, and
# into so many along an edge at most: then the area is within 1 %.
_PIECE, _MOST = 0.1, 20


@dataclass(frozen=True, eq=False)
class DotSkin:
    """Parts of triangles under B dots; immutable.

    The centroid of a part keeps its place on the triangle, and the part its share of the triangle's
    area, however the triangle moves.

    Attributes
    ----------
    vertices : (V,) int64
        Of the mesh: those of the dots, and of the triangles under them.
    points : (V, 3) float64 [m]
        Their positions on the neutral face.
    evaluator : BlendShapeEvaluator
        Of their displacements, N = 3 V.
    radii : (B,) float64 [m]
        Of the dots; NaN = unknown.
    bound : (B,) int64
        Place among `vertices` of the one that each dot is bound to.
    dots : (N,) int64
        The dot of each part.
    triangles : (N, 3) int64
        Places of their corners among `vertices`.
    shares : (N,) float64
        Of the triangle's area that is under the dot.
    centroids : (N, 3) float64
        Of the part under the dot, in barycentric coordinates of the triangle.
    beside : (B, V) float64 or None
        Added to the weights of the vertices in each mean: markers that are beside their dots'
        vertices. None = they are not.
    """

    vertices: IntArray
    points: FloatArray
    evaluator: BlendShapeEvaluator
    radii: FloatArray
    bound: IntArray
    dots: IntArray
    triangles: IntArray
    shares: FloatArray
    centroids: FloatArray
    beside: FloatArray | None = None

    @cached_property
    def means(self) -> FloatArray:
        """Weights of the vertices in the mean of each dot's skin at rest, by area: (B, V).

        A dot without skin is where its vertex is.
        """
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        areas = self.shares * 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        whole = np.bincount(self.dots, areas, len(self.bound))
        means = np.zeros((len(self.bound), len(self.vertices)))
        alone = np.flatnonzero(whole <= 0.0)
        means[alone, self.bound[alone]] = 1.0
        shares = areas / np.where(whole > 0.0, whole, 1.0)[self.dots]
        np.add.at(means, (self.dots[:, None], self.triangles), shares[:, None] * self.centroids)
        return frozen(means)

    @cached_property
    def places(self) -> FloatArray:
        """Weights of the vertices in the place of each marker: (B, V)."""
        return self.means if self.beside is None else frozen(self.means + self.beside)

    @cached_property
    def rest(self) -> FloatArray:
        """The markers on the neutral face: (B, 3) [m]."""
        return frozen(self.places @ self.points)

    @cached_property
    def marker_evaluator(self) -> BlendShapeEvaluator:
        """Of the displacements of the markers, N = 3 B."""
        return self.evaluator.mapped(interpolated(self.places))

    @property
    def offsets(self) -> FloatArray:
        """Displacements of the markers by each blend shape at weight 1: (S, B, 3) [m]."""
        offsets = self.marker_evaluator.offsets
        return offsets.reshape(len(offsets), -1, 3)

    def select(self, dots: IntArray) -> "DotSkin":
        """Return the skin under some of the dots."""
        number = np.full(len(self.bound), -1)
        number[dots] = np.arange(len(dots))
        kept = number[self.dots] >= 0
        return replace(
            self,
            radii=self.radii[dots],
            bound=self.bound[dots],
            dots=number[self.dots[kept]],
            triangles=self.triangles[kept],
            shares=self.shares[kept],
            centroids=self.centroids[kept],
            beside=None if self.beside is None else self.beside[dots],
        )


def interpolated(weights: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the function of coordinates (K, 3 V) of vertices to those of places (K, 3 B).

    `weights` (B, V) are those of the vertices in each place.
    """

    def at_places(values: FloatArray) -> FloatArray:
        at = values.reshape(len(values), values.shape[1] // 3, 3)
        moved = np.einsum("bv,svd->sbd", weights, at, optimize=True)
        return np.asarray(moved.reshape(len(values), 3 * len(weights)))

    return at_places


def dot_skin(
    mesh: Mesh, vertices: IntArray, radii: FloatArray, others: IntArray | None = None
) -> DotSkin:
    """Return the skin under dots that are painted on a neutral face.

    A dot covers the skin within its radius that is connected to its vertex and faces the same way.

    Parameters
    ----------
    mesh : Mesh
    vertices : (B,) int64
        In the middle of the dots.
    radii : (B,) float64 [m]
        NaN = unknown: then the dot is where its vertex is.
    others : (K,) int64, optional
        Vertices that the skin has as well.
    """
    dotted = np.flatnonzero(radii > 0.0)
    if len(dotted):
        corners, _ = triangulated(mesh.face_counts, mesh.face_indices, mesh.points)
        triangles = mesh.face_indices[corners]
        joined = joined_at_seams(mesh)[triangles]
        a, b, c = (mesh.points[triangles[:, k]] for k in range(3))
        middles, normals = (a + b + c) / 3.0, np.cross(b - a, c - a)
        reaches = np.sqrt(np.max([((p - middles) ** 2).sum(axis=1) for p in (a, b, c)], axis=0))
    dots, parts, shares, centroids = [], [], [], []
    for dot in dotted.tolist():
        vertex, radius = int(vertices[dot]), float(radii[dot])
        place = mesh.points[vertex]
        near = np.linalg.norm(middles - place, axis=1) < reaches + radius
        own = np.flatnonzero(near & (normals @ _normal(triangles, normals, vertex) > 0.0))
        share, centroid = _under(mesh.points[triangles[own]] - place, radius)
        own, share, centroid = own[share > 0], share[share > 0], centroid[share > 0]
        whole = _connected(joined[own], (triangles[own] == vertex).any(axis=1))
        dots.append(np.full(whole.sum(), dot))
        parts.append(triangles[own[whole]])
        shares.append(share[whole])
        centroids.append(centroid[whole])
    under = np.concatenate([*parts, np.zeros((0, 3), np.int64)])
    extra = np.zeros(0, np.int64) if others is None else others
    used, places = np.unique(np.concatenate([vertices, under.ravel(), extra]), return_inverse=True)
    return DotSkin(
        vertices=used,
        points=mesh.points[used],
        evaluator=evaluator_of(mesh.shapes, used)[0],
        radii=radii,
        bound=places[: len(vertices)],
        dots=np.concatenate([*dots, np.zeros(0, np.int64)]),
        triangles=places[len(vertices) : len(vertices) + under.size].reshape(-1, 3),
        shares=np.concatenate([*shares, np.zeros(0)]),
        centroids=np.concatenate([*centroids, np.zeros((0, 3))]),
    )


def _normal(triangles: IntArray, normals: FloatArray, vertex: int) -> FloatArray:
    return np.asarray(normals[(triangles == vertex).any(axis=1)].sum(axis=0))


def _under(corners: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return shares (T,) of triangles within a radius of the origin, and centroids (T, 3) of these.

    Parameters
    ----------
    corners : (T, 3, 3) float64 [m]
    radius : float [m]
    """
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(initial=0.0)
    count = int(np.clip(np.ceil(longest / (_PIECE * radius)), 1, _MOST))
    pieces = _pieces(count)
    inside = ((pieces @ corners) ** 2).sum(axis=2) < radius**2
    number = inside.sum(axis=1)
    centroids = inside @ pieces / np.maximum(number, 1)[:, None]
    return number / len(pieces), centroids


def _pieces(count: int) -> FloatArray:
    """Return the barycentric centres of a triangle's equal pieces, `count` along each edge."""
    first, second = np.mgrid[:count, :count].reshape(2, -1)
    upright, turned = first + second < count, first + second < count - 1
    places = np.concatenate(
        [
            np.stack([first, second], axis=1)[upright] + 1.0 / 3.0,
            np.stack([first, second], axis=1)[turned] + 2.0 / 3.0,
        ]
    )
    return np.column_stack([places / count, 1.0 - places.sum(axis=1) / count])


def _connected(triangles: IntArray, start: BoolArray) -> BoolArray:
    """Return which triangles (T, 3) are connected by corners to those of the start (T,)."""
    found, count = start, -1
    while count < found.sum():
        count = int(found.sum())
        found = np.asarray(np.isin(triangles, triangles[found]).any(axis=1))
    return found
