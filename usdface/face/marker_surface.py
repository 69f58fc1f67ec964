"""The skin around bound vertices: points and blend shapes at places beside them.

A place is a shift along the skin from a marker's vertex. It is looked up on the mesh around: the
nearest vertex of the neighbourhood, and from there along the tangent plane by the slopes of the
points and blend shapes, fitted to the vertices near by. Neighbourhoods follow the mesh's edges, so
that no place crosses from one lip or lid to the other.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from usdface.arrays import BoolArray, FloatArray, IntArray, frozen
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.dot_skin import DotSkin, dot_skin, interpolated
from usdface.face.known_limits import with_known_limits
from usdface.face.skin_patch import SkinPatch, skin_patch
from usdface.face.surface_graph import surface_graph
from usdface.geometry.marker_spread import rms_radius
from usdface.rigs import BlendShape, Mesh

__all__ = ["MarkerSurface", "PlacedMarkers"]

# How far from its vertex a place is searched, and how far around a vertex slopes are fitted, as
# shares of the RMS radius of the markers: 9 mm and 5 mm on the ICT face. Set by hand: markers that
# are placed with care are within half a centimetre, and skin is smooth over less.
_REACH, _AROUND = 0.15, 0.08
# At most so many vertices of a neighbourhood: a bound on time and memory on dense meshes.
_MOST = 200


@dataclass(frozen=True, eq=False, slots=True)
class PlacedMarkers:
    """Markers at places on the skin.

    Attributes
    ----------
    skin : DotSkin
        Around them.
    vertices : (B,) int64
        Nearest to them.
    tangents : (B, 2, 3) float64
        Orthonormal directions along the skin.
    slopes : tuple of two BlendShapeEvaluator
        Of the change of the displacements with a shift along either tangent, N = 3 B.
    """

    skin: DotSkin
    vertices: IntArray
    tangents: FloatArray
    slopes: tuple[BlendShapeEvaluator, BlendShapeEvaluator]

    @property
    def points(self) -> FloatArray:
        """Rest positions of the places: (B, 3) [m]."""
        return self.skin.rest

    @property
    def evaluator(self) -> BlendShapeEvaluator:
        """Of their displacements, N = 3 B."""
        return self.skin.marker_evaluator

    def mapped(
        self, sized: Callable[[BlendShapeEvaluator], BlendShapeEvaluator]
    ) -> "PlacedMarkers":
        """Return the same places moved by the shapes that `sized` makes of these."""
        first, second = self.slopes
        skin = replace(self.skin, evaluator=sized(self.skin.evaluator))
        return replace(self, skin=skin, slopes=(sized(first), sized(second)))


@dataclass(frozen=True, eq=False)
class MarkerSurface:
    """The mesh around B bound vertices; immutable.

    Attributes
    ----------
    mesh : Mesh
    vertices : (B,) int64
    radii : (B,) float64 [m] or None
        Of painted dots, which move as the mean of the skin under them; NaN, None = unknown.
    known_limits : bool
        Blend shapes keep the limits that are known by their names.
    """

    mesh: Mesh
    vertices: IntArray
    radii: FloatArray | None = None
    known_limits: bool = False

    @cached_property
    def skin(self) -> DotSkin:
        """The skin under the dots around the bound vertices."""
        return self._skin(self.vertices)

    @cached_property
    def reach(self) -> float:
        """The largest distance of a place from its vertex [m]."""
        return _REACH * rms_radius(self.mesh.points[self.vertices])

    def within_reach(self, shifts: FloatArray) -> FloatArray:
        """Return shifts (B, 3) that are no longer than `reach`."""
        far = np.linalg.norm(shifts, axis=1, keepdims=True)
        return np.asarray(shifts * np.minimum(1.0, self.reach / np.maximum(far, 1e-30)))

    def select(self, markers: IntArray) -> "MarkerSurface":
        """Return the surface around some of the bound vertices."""
        radii = None if self.radii is None else self.radii[markers]
        return replace(self, vertices=self.vertices[markers], radii=radii)

    def with_shapes(self, shapes: tuple[BlendShape, ...]) -> "MarkerSurface":
        """Return the same surface moved by other blend shapes."""
        surface = replace(self, mesh=replace(self.mesh, shapes=shapes))
        surface.__dict__.update(_graph=self._graph, _lengths=self._lengths, patch=self.patch)
        return surface

    def at(self, shifts: FloatArray) -> PlacedMarkers:
        """Return the markers shifted from their vertices by `shifts` (B, 3) [m], along the skin."""
        wanted = self.mesh.points[self.vertices] + shifts
        nearest, around, inner = [], [], _AROUND / _REACH * self.reach
        for vertex, place, shift in zip(self.vertices, wanted, shifts, strict=True):
            near, along_skin = self._near(int(vertex), self.reach)
            away = np.linalg.norm(self.mesh.points[near] - place, axis=1)
            # A vertex across a slit, as on the other lip, is far along the skin, though near the
            # place.
            away = np.maximum(away, along_skin - np.linalg.norm(shift))
            nearest.append(int(near[away.argmin()]))
            around.append(self._near(nearest[-1], inner)[0])
        frames = [self._frame(v, n) for v, n in zip(nearest, around, strict=True)]
        tangents = np.stack([tangent for tangent, _ in frames])
        skin = self._skin(np.array(nearest), np.unique(np.concatenate(around)))
        column = np.full(len(self.mesh.points), -1)
        column[skin.vertices] = np.arange(len(skin.vertices))
        along = np.zeros((2, len(wanted), len(skin.vertices)))
        for marker, (near, (_, slope)) in enumerate(zip(around, frames, strict=True)):
            along[:, marker, column[near]] = slope
        rest = wanted - self.mesh.points[nearest]
        share = np.einsum("bad,bd->ab", tangents, rest)
        first, second = (skin.evaluator.mapped(interpolated(slopes)) for slopes in along)
        return PlacedMarkers(
            replace(skin, beside=np.einsum("ab,abn->bn", share, along)),
            np.array(nearest),
            frozen(tangents),
            (first, second),
        )

    def _skin(self, vertices: IntArray, others: IntArray | None = None) -> DotSkin:
        radii = np.full(len(vertices), np.nan) if self.radii is None else self.radii
        skin = dot_skin(self.mesh, vertices, radii, others)
        if not self.known_limits:
            return skin
        evaluator = with_known_limits(skin.evaluator, self.mesh.shape_names)
        return replace(skin, evaluator=evaluator)

    def vertices_near(self, marker: int) -> IntArray:
        """Return the vertices within `reach` of a marker's own, along the skin: (n,)."""
        return self._near(int(self.vertices[marker]), self.reach)[0]

    def _near(self, vertex: int, reach: float) -> tuple[IntArray, FloatArray]:
        """Return the vertices within `reach` along the skin, and those of its own faces.

        Then how far they are along it [m].
        """
        if vertex not in self._lengths:
            graph = self._graph
            far = dijkstra(graph, directed=False, indices=vertex, limit=self.reach)
            row = slice(*graph.indptr[vertex : vertex + 2])
            ring = graph.indices[row]
            far[ring] = np.minimum(far[ring], graph.data[row])
            near = np.flatnonzero(np.isfinite(far))
            near = near[np.argsort(far[near], kind="stable")][:_MOST]
            near = np.union1d(near, ring)
            self._lengths[vertex] = near, far[near], np.isin(near, ring)
        near, far, ring = self._lengths[vertex]
        kept = (far <= reach) | ring
        return near[kept], far[kept]

    def _frame(self, vertex: int, around: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return tangents (2, 3) at a vertex, and the map from values around to slopes (2, n)."""
        away = self.mesh.points[around] - self.mesh.points[vertex]
        tangents = np.linalg.svd(away, full_matrices=False)[2][:2]
        if len(tangents) < 2:
            return np.eye(3)[:2], np.zeros((2, len(around)))
        slope = np.linalg.pinv(away @ tangents.T, rcond=1e-3)
        slope[:, around == vertex] -= slope.sum(axis=1, keepdims=True)
        return tangents, slope

    @cached_property
    def patch(self) -> SkinPatch:
        """The connected skin around the markers."""
        return skin_patch(self.mesh, self.vertices)

    @cached_property
    def _graph(self) -> csr_array:
        graph = surface_graph(self.mesh)
        return csr_array(graph + graph.T)

    @cached_property
    def _lengths(self) -> dict[int, tuple[IntArray, FloatArray, BoolArray]]:
        return {}
