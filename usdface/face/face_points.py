"""The vertices of a mesh that are its face: those of markers, else those that blend shapes move."""

from typing import NamedTuple

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.rigs import Mesh

__all__ = ["FacePoints", "face_points"]


class FacePoints(NamedTuple):
    """Vertices (N,) of a face, and the share of each (N,); none where nothing tells."""

    vertices: IntArray
    shares: FloatArray

    def box(self, points: FloatArray, left_out: float) -> tuple[FloatArray, FloatArray]:
        """Return the corners of the box (3,) [m] around the face, without a share at each side."""
        own = points[self.vertices]
        corners = np.empty((2, 3))
        for axis in range(3):
            order = np.argsort(own[:, axis], kind="stable")
            below = np.cumsum(self.shares[order])
            first, last = np.searchsorted(below, [left_out, 1.0 - left_out]).tolist()
            corners[:, axis] = own[order[[first, min(last, len(order) - 1)]], axis]
        return corners[0], corners[1]


def face_points(mesh: Mesh, markers: IntArray) -> FacePoints:
    """Return the vertices of markers, of equal shares, else those that the blend shapes move.

    Each blend shape counts alike, and in it each vertex by the square of its offset: so a shape of
    the body beside those of a face counts little, and one that hardly moves counts not at all.

    Parameters
    ----------
    mesh : Mesh
    markers : (B,) int64
        Vertices; those that the mesh has not are left out.
    """
    bound = markers[(markers >= 0) & (markers < len(mesh.points))]
    if len(bound):
        return FacePoints(bound, np.full(len(bound), 1.0 / len(bound)))
    shares = np.zeros(len(mesh.points))
    for shape in mesh.shapes:
        squares = (shape.offsets**2).sum(axis=1)
        if squares.any():
            shares[shape.indices] += squares / squares.sum()
    vertices = np.flatnonzero(shares)
    return FacePoints(vertices, shares[vertices] / max(float(shares.sum()), 1e-300))
