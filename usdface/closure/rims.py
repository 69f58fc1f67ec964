"""The rims of two lids as points and surfaces: where they touch in a pose, and how far apart."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, vstack
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.face_corners import next_corners
from usdface.geometry.vertex_normals import unit_or_zero, vertex_normals
from usdface.rigs import Mesh

__all__ = ["RimPairs", "rim_pairs"]

# Normals of points that touch are opposed: cosine below this, 102 degrees and more apart.
_OPPOSED = -0.2
# Rings of faces around the known vertices of a rim that belong to it.
_RINGS = 2


@dataclass(frozen=True, eq=False, slots=True)
class RimPairs:
    """K pairs of a point of one lid and a point of the other.

    Attributes
    ----------
    points : (K, V) sparse float64
        Shares of the mesh's vertices in the first point minus those in the second.
    directions : (K, 3) float64
        Unit normals at the second point, in the closed pose.
    """

    points: csr_array
    directions: FloatArray

    @property
    def vertices(self) -> IntArray:
        """The vertices (N,) that have a share in any pair."""
        return np.unique(self.points.indices).astype(np.int64)

    def apertures(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """Return the apertures (..., K) of positions or displacements (..., 3 N) of `vertices`."""
        own = self.points[:, vertices]
        apart = values.reshape(-1, len(vertices), 3)
        apertures = np.stack([own @ apart[..., axis].T for axis in range(3)], axis=-1)
        return np.asarray(
            (apertures * self.directions[:, None]).sum(axis=2).T.reshape(*values.shape[:-1], -1)
        )

    def select(self, pairs: IntArray) -> "RimPairs":
        """Return the pairs of some rows (K,), in their order."""
        return RimPairs(csr_array(self.points[pairs]), self.directions[pairs])


def rim_pairs(mesh: Mesh, lids: IntArray, closed: FloatArray, reach: float) -> RimPairs:
    """Pair points of the two rims that are near to each other in the closed pose.

    Parameters
    ----------
    mesh : Mesh
    lids : (P, 2) int64
        Vertices of the upper and of the lower rim.
    closed : (V, 3) float64 [m]
        The mesh with the eye closed.
    reach : float [m]
        Largest distance of a pair there.
    """
    rims = [_grown(mesh, np.unique(lids[:, k]), np.unique(lids[:, 1 - k])) for k in (0, 1)]
    normals = _normals(mesh, closed, np.concatenate(rims))
    samples = [_samples(mesh, rim) for rim in rims]
    points, directions = [], []
    for rim, target in ((rims[0], samples[1]), (rims[1], samples[0])):
        there, facing = target @ closed, unit_or_zero(target @ normals)
        distance, nearest = cKDTree(there).query(closed[rim], distance_upper_bound=reach)
        near = np.flatnonzero(np.isfinite(distance))
        facing_pairs = (normals[rim[near]] * facing[nearest[near]]).sum(axis=1) < _OPPOSED
        near = near[facing_pairs]
        vertex = _unit_rows(rim[near], len(mesh.points))
        points.append(vertex - target[nearest[near]])
        directions.append(facing[nearest[near]])
    return RimPairs(csr_array(vstack(points)), np.concatenate(directions))


def _grown(mesh: Mesh, rim: IntArray, other: IntArray) -> IntArray:
    """Return the vertices within some rings of faces around a rim, without those of the other."""
    for _ in range(_RINGS):
        _, corners = _faces_at(mesh, rim)
        rim = np.setdiff1d(corners, other)
    return rim


def _normals(mesh: Mesh, points: FloatArray, vertices: IntArray) -> FloatArray:
    """Return the normals (V, 3) of the mesh at `points`, valid at some vertices."""
    return vertex_normals(points, *_faces_at(mesh, vertices))


def _faces_at(mesh: Mesh, vertices: IntArray) -> tuple[IntArray, IntArray]:
    """Return the faces that touch some vertices: counts and indices."""
    at = np.zeros(len(mesh.points), dtype=bool)
    at[vertices] = True
    face = np.repeat(np.arange(len(mesh.face_counts)), mesh.face_counts)
    touched = np.zeros(len(mesh.face_counts), dtype=bool)
    touched[face[at[mesh.face_indices]]] = True
    return mesh.face_counts[touched], mesh.face_indices[touched[face]]


def _samples(mesh: Mesh, rim: IntArray) -> csr_array:
    """Return points of the surface among the vertices of a rim: shares (N, V).

    The vertices, and the centres of the edges and faces between them.
    """
    counts, corners = mesh.face_counts, mesh.face_indices
    face = np.repeat(np.arange(len(counts)), counts)
    inside = np.isin(corners, rim)
    whole = np.bincount(face, weights=inside, minlength=len(counts)) == counts
    edges = np.unique(
        np.sort(np.stack([corners, corners[next_corners(counts)]], axis=1)[whole[face]], axis=1),
        axis=0,
    )
    centre_of = np.cumsum(whole) - 1
    used = whole[face]
    rows = centre_of[face[used]]
    centres = coo_array(
        (1.0 / counts[face[used]], (rows, corners[used])), (int(whole.sum()), len(mesh.points))
    )
    halves = coo_array(
        (np.full(edges.size, 0.5), (np.repeat(np.arange(len(edges)), 2), edges.ravel())),
        (len(edges), len(mesh.points)),
    )
    return csr_array(vstack([_unit_rows(rim, len(mesh.points)), halves, centres]))


def _unit_rows(vertices: IntArray, count: int) -> csr_array:
    ones = np.ones(len(vertices))
    return csr_array((ones, (np.arange(len(vertices)), vertices)), (len(vertices), count))
