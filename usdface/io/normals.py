"""Smooth vertex normals of polygon meshes."""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["normals_of_faces", "smooth_normals", "unit"]


def unit(vectors: FloatArray) -> FloatArray:
    """Return `vectors` (N, 3) at length 1; one without a direction becomes (0, 1, 0)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > np.finfo(np.float64).tiny)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.where(usable, vectors / length, (0.0, 1.0, 0.0))


def normals_of_faces(
    face_counts: IntArray, face_indices: IntArray, count: int
) -> Callable[[FloatArray], FloatArray]:
    """Return a function from points (count, 3) to their unit vertex normals (count, 3).

    A vertex normal is the sum of the area vectors of the faces around it (Newell's sum, so
    that bent polygons are fine), hence weighted by area. A vertex without a face gets
    (0, 1, 0). The faces are prepared once, for the many poses of one mesh.
    """
    from scipy.sparse import csr_array  # costs more to import than faces with normals need

    corners = np.arange(len(face_indices))
    stops = np.cumsum(face_counts)
    starts = stops - face_counts
    first = np.repeat(starts, face_counts)
    following = np.where(corners + 1 == np.repeat(stops, face_counts), first, corners + 1)
    ones = np.ones(len(face_indices))
    face_of = np.repeat(np.arange(len(face_counts)), face_counts)
    sum_over_face = csr_array((ones, (face_of, corners)), (len(face_counts), len(corners)))
    sum_at_vertex = csr_array((ones, (face_indices, face_of)), (count, len(face_counts)))
    here, there, origin = face_indices, face_indices[following], face_indices[first]

    def normals(points: FloatArray) -> FloatArray:
        # Relative to a point of the face: far from the origin the sum would cancel.
        start = points[origin]
        spans = np.cross(points[here] - start, points[there] - start)
        return unit(sum_at_vertex @ (sum_over_face @ spans))

    return normals


def smooth_normals(points: FloatArray, face_counts: IntArray, face_indices: IntArray) -> FloatArray:
    """Return the smooth unit normals (V, 3) of one mesh (see `normals_of_faces`)."""
    return normals_of_faces(face_counts, face_indices, len(points))(points)
