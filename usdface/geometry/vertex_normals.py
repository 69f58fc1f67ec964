"""Vertex normals of polygon meshes, weighted by the areas of the faces around a vertex."""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.face_corners import next_corners
from usdface.numerics.matching_rows import matching_rows

__all__ = [
    "NormalsNear",
    "normals_of_faces",
    "triangle_normals",
    "unit_or_up",
    "unit_or_zero",
    "vertex_normals",
]


def unit_or_up(vectors: FloatArray) -> FloatArray:
    """Return `vectors` (N, 3) at length 1; one without a direction becomes (0, 1, 0)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > np.finfo(np.float64).tiny)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.where(usable, vectors / length, (0.0, 1.0, 0.0))


def unit_or_zero(vectors: FloatArray) -> FloatArray:
    """Return `vectors` (N, 3) at length 1; zero vectors stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def normals_of_faces(
    face_counts: IntArray, face_indices: IntArray, count: int
) -> Callable[[FloatArray], FloatArray]:
    """Return a function from points (count, 3) to their unit vertex normals (count, 3).

    The faces are prepared once, for the many poses of one mesh. A vertex without a face gets
    (0, 1, 0), as files want normals of length 1.
    """
    area_vectors = _area_vectors(face_counts, face_indices, count)
    return lambda points: unit_or_up(area_vectors(points))


class NormalsNear:
    """Normals of some vertices of a mesh, in time proportional to the faces around them.

    Parameters
    ----------
    face_counts : (P,) int64
    face_indices : (C,) int64
    count : int
        Vertices of the mesh.
    """

    def __init__(self, face_counts: IntArray, face_indices: IntArray, count: int) -> None:
        self._counts, self._indices, self._count = face_counts, face_indices, count
        self._faces = np.repeat(np.arange(len(face_counts)), face_counts)

    def _around(self, vertices: IntArray) -> tuple[IntArray, IntArray]:
        """Return the faces that touch some vertices: their corner counts and vertices."""
        touched = np.zeros(self._count, bool)
        touched[vertices] = True
        faces = np.zeros(len(self._counts), bool)
        faces[self._faces[touched[self._indices]]] = True
        return self._counts[faces], self._indices[faces[self._faces]]

    def ring(self, vertices: IntArray) -> IntArray:
        """Return the vertices (N,) whose normals change where `vertices` move, increasing."""
        return np.unique(self._around(vertices)[1])

    def at(self, points: FloatArray, vertices: IntArray) -> FloatArray:
        """Return the unit normals (len(vertices), 3) for the points (count, 3) of the mesh.

        A vertex without a face gets (0, 1, 0).
        """
        counts, corners = self._around(vertices)
        used, local = np.unique(corners, return_inverse=True)
        result = np.tile([0.0, 1.0, 0.0], (len(vertices), 1))
        if len(used):
            normals = unit_or_up(_area_vectors(counts, local, len(used))(points[used]))
            where, rows = matching_rows(used, vertices)
            result[where] = normals[rows]
        return result


def vertex_normals(points: FloatArray, face_counts: IntArray, face_indices: IntArray) -> FloatArray:
    """Return the unit vertex normals (V, 3) of one mesh; zero where a vertex has no face.

    Parameters
    ----------
    points : (V, 3) float64
    face_counts : (N,) int64
        Corners of each face.
    face_indices : (sum of the counts,) int64
        The vertex of each corner, face after face.
    """
    return unit_or_zero(_area_vectors(face_counts, face_indices, len(points))(points))


def triangle_normals(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the `vertex_normals` (V, 3) of points (V, 3) and triangles (T, 3)."""
    return vertex_normals(points, np.full(len(triangles), 3), triangles.ravel())


def _area_vectors(
    face_counts: IntArray, face_indices: IntArray, count: int
) -> Callable[[FloatArray], FloatArray]:
    """Return a function from points (count, 3) to the area vectors around each (count, 3).

    The area vector of a polygon, bent or not, is half the sum of the cross products of its edges'
    ends (M. E. Newell; Sutherland, Sproull and Schumacker 1974). Twice the area counts here.
    """
    from scipy.sparse import csr_array  # costs more to import than faces with normals need

    corners = np.arange(len(face_indices))
    first = np.repeat(np.cumsum(face_counts) - face_counts, face_counts)
    ones = np.ones(len(face_indices))
    face_of = np.repeat(np.arange(len(face_counts)), face_counts)
    sum_over_face = csr_array((ones, (face_of, corners)), (len(face_counts), len(corners)))
    sum_at_vertex = csr_array((ones, (face_indices, face_of)), (count, len(face_counts)))
    here, there = face_indices, face_indices[next_corners(face_counts)]
    origin = face_indices[first]

    def area_vectors(points: FloatArray) -> FloatArray:
        # Relative to a point of the face: far from the origin the sum would cancel.
        start = points[origin]
        spans = np.cross(points[here] - start, points[there] - start)
        return np.asarray(sum_at_vertex @ (sum_over_face @ spans))

    return area_vectors
