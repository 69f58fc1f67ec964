"""The skin around bound vertices as triangles: gradients, smooth fields and shapes of other faces.

Vertices that files split along texture seams are joined, so that a field does not tear there.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.face.surface_graph import joined_at_seams
from usdface.geometry.marker_spread import rms_radius
from usdface.rigs import Mesh

__all__ = ["SkinPatch", "skin_patch"]

# The patch reaches so far beyond the markers, in RMS radii of theirs: fields have died away there.
_MARGIN = 1.0
# Fields are flat over this share of that radius around a marker, else they would have a spike
# there. 0.03 to 0.06 do equally well on the performers that the solve was built with.
_ROUNDED = 0.05
# Markers hold a field this much better than its own stiffness, and nothing else holds it at all.
_HELD, _LOOSE = 1e-4, 1e-9
# Shapes of another face are anchored at the source's by this length in radii: translation is free.
_ANCHORED = 3.0
# Triangles of less than this share of the squared radius have no gradient.
_FLAT = 1e-12


@dataclass(frozen=True, eq=False)
class SkinPatch:
    """Triangles around markers; immutable.

    Attributes
    ----------
    vertices : (P,) int64
        Of the mesh, one for each place.
    place_of : (V,) int64
        The place of each vertex of the mesh in the patch; -1 = outside.
    points : (P, 3) float64 [m]
    triangles : (T, 3) int64
    size : float [m]
        RMS radius of the markers.
    """

    vertices: IntArray
    place_of: IntArray
    points: FloatArray
    triangles: IntArray
    size: float

    def field(self, places: IntArray, values: FloatArray) -> FloatArray:
        """Return the smooth field with given `values` (N, 3) at some places (N,): (P, 3).

        It minimises stretch, and bending where that would leave spikes: ``|grad u|^2 + l^2
        |laplace u|^2`` integrated over the patch.
        """
        held = sparse.csr_matrix(
            (np.ones(len(places)), (np.arange(len(places)), places)),
            (len(places), len(self.points)),
        )
        stiff = self._laplacian
        bend = stiff @ sparse.diags((_ROUNDED * self.size) ** 2 / self._areas) @ stiff
        whole = stiff + bend + held.T @ held / _HELD + _LOOSE * sparse.identity(len(self.points))
        return np.asarray(splu(sparse.csc_matrix(whole)).solve(held.T @ values / _HELD))

    def transferred(self, target: FloatArray, displacements: FloatArray) -> FloatArray:
        """Return the displacements (K, P, 3) transferred to another face of these triangles.

        Deformation transfer (R. Sumner and J. Popovic, "Deformation Transfer for Triangle Meshes",
        SIGGRAPH 2004): each triangle deforms as that of the source does, least squares by area.
        Loosely anchored at the source's own displacements, since translation is free.

        Parameters
        ----------
        target : (P, 3) float64 [m]
            The other face's neutral points.
        displacements : (K, P, 3) float64 [m]
        """
        gradient, areas, masses = _gradient(target, self.triangles, self.size)
        weighted = (sparse.diags(np.repeat(areas, 3)) @ gradient).T.tocsr()
        anchor = masses / (_ANCHORED * self.size) ** 2
        factor = splu(sparse.csc_matrix(weighted @ gradient + sparse.diags(anchor)))
        rest = np.linalg.inv(_edges(self.points, self.triangles, self.size))
        right = np.empty((len(displacements), len(self.points), 3))
        for number, moved in enumerate(displacements):
            deformed = _edges(self.points + moved, self.triangles, self.size) @ rest - np.eye(3)
            right[number] = weighted @ deformed.transpose(0, 2, 1).reshape(-1, 3)
        right += anchor[:, None] * displacements
        flat = right.transpose(1, 0, 2).reshape(len(self.points), -1)
        return np.asarray(factor.solve(flat).reshape(len(self.points), -1, 3).transpose(1, 0, 2))

    @cached_property
    def _laplacian(self) -> sparse.csr_matrix:
        gradient, areas, _ = _gradient(self.points, self.triangles, self.size)
        return sparse.csr_matrix(gradient.T @ sparse.diags(np.repeat(areas, 3)) @ gradient)

    @cached_property
    def _areas(self) -> FloatArray:
        return _gradient(self.points, self.triangles, self.size)[2]


def skin_patch(mesh: Mesh, bound: IntArray) -> SkinPatch:
    """Return the connected skin around vertices `bound` (B,)."""
    size = rms_radius(mesh.points[bound])
    joined = joined_at_seams(mesh)
    triangles = joined[_triangles(mesh)]
    far = cKDTree(mesh.points[bound]).query(mesh.points)[0]
    triangles = triangles[(far[triangles] <= _MARGIN * size).all(axis=1)]
    a, b, c = (mesh.points[triangles[:, k]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    triangles = triangles[areas > _FLAT * size**2]
    edges = (np.ones(2 * len(triangles)), (triangles[:, [0, 0]].ravel(), triangles[:, 1:].ravel()))
    graph = sparse.csr_matrix(edges, (len(mesh.points),) * 2)
    component = connected_components(graph, directed=False)[1]
    kept = np.isin(component, component[joined[bound]])
    triangles = triangles[kept[triangles].all(axis=1)]
    vertices, inverse = np.unique(triangles, return_inverse=True)
    place = np.full(len(mesh.points), -1)
    place[vertices] = np.arange(len(vertices))
    return SkinPatch(
        vertices, place[joined], mesh.points[vertices], inverse.reshape(triangles.shape), size
    )


def _triangles(mesh: Mesh) -> IntArray:
    """Return the faces cut into fans of triangles: (T, 3)."""
    counts, first = mesh.face_counts, np.cumsum(mesh.face_counts) - mesh.face_counts
    fans = [
        mesh.face_indices[first[counts > k + 1][:, None] + np.array([0, k, k + 1])]
        for k in range(1, int(counts.max(initial=0)) - 1)
    ]
    return np.concatenate([*fans, np.zeros((0, 3), np.int64)])


def _edges(points: FloatArray, triangles: IntArray, size: float) -> FloatArray:
    """Return two edges and the normal, as long as the root of its area, as columns: (T, 3, 3)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), _FLAT * size**2)
    return np.stack([b - a, c - a, normal / np.sqrt(length)[:, None]], axis=2)


def _gradient(
    points: FloatArray, triangles: IntArray, size: float
) -> tuple[sparse.csr_matrix, FloatArray, FloatArray]:
    """Return the operator from values at vertices to gradients, areas of triangles and vertices.

    Returns
    -------
    (3 T, P) sparse float64 [1/m]
        Row 3 t + i is the derivative along axis i on triangle t, in its plane.
    (T,) float64 [m^2]
    (P,) float64 [m^2]
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    twice = np.maximum((normal**2).sum(axis=1), (_FLAT * size**2) ** 2)
    of_b, of_c = (np.cross(e, f) / twice[:, None] for e, f in ((c - a, normal), (normal, b - a)))
    values = np.stack([-of_b - of_c, of_b, of_c], axis=1)
    rows = 3 * np.arange(len(triangles))[:, None] + np.arange(3)
    rows = np.broadcast_to(rows[:, None], values.shape)
    columns = np.broadcast_to(triangles[:, :, None], values.shape)
    shape = (3 * len(triangles), len(points))
    gradient = sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape)
    areas = 0.5 * np.sqrt(twice)
    own = np.bincount(triangles.ravel(), np.repeat(areas, 3) / 3.0, len(points))
    return gradient, areas, own.astype(np.float64)
