"""Descriptions of vertices: "left cheek, 14 mm from marker m7 (vertex 310)"."""

import numpy as np

from usdface.arrays import IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import sides_of
from usdface.face.place import Place
from usdface.face.regions import regions_of

__all__ = ["place_descriptions", "places_of"]

_SIDES = {1: "left", -1: "right"}
# Half the width of the middle, as a share of the face's width.
_MIDDLE = 0.06


def place_descriptions(face: BoundFace, vertices: IntArray) -> tuple[str, ...]:
    """Return descriptions of vertices (N,): region, side, and the nearest bound marker."""
    return tuple(map(str, places_of(face, vertices)))


def places_of(face: BoundFace, vertices: IntArray) -> tuple[Place, ...]:
    """Return the region and side of vertices (N,), and the nearest bound marker.

    Left is the character's.
    """
    mesh = face.mesh
    moved = np.unique(np.concatenate([s.indices for s in mesh.shapes]))
    low, high = mesh.points[moved, 0].min(), mesh.points[moved, 0].max()
    middle, width = (low + high) / 2, max(high - low, 1e-12)
    sides = sides_of(mesh.points[vertices], middle, _MIDDLE * width)
    regions = regions_of(mesh, vertices)
    return tuple(
        _place(face, vertex, region, _SIDES.get(side, ""))
        for vertex, region, side in zip(vertices.tolist(), regions, sides.tolist(), strict=True)
    )


def _place(face: BoundFace, vertex: int, region: str, side: str) -> Place:
    if not face.markers:
        return Place(vertex, region, side)
    away = np.linalg.norm(face.neutral - face.mesh.points[vertex], axis=1)
    nearest = int(away.argmin())
    distance = round(1000.0 * float(away[nearest]), 1)
    return Place(vertex, region, side, face.markers[nearest], distance)
