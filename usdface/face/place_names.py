"""Descriptions of vertices: "left cheek, 14 mm from marker m7 (vertex 310)"."""

import numpy as np

from usdface.arrays import IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import sides_of
from usdface.face.regions import regions_of

__all__ = ["place_names"]

_ONE = {"cheeks": "cheek", "brows": "brow", "eyes": "eye"}
_SIDES = {1: "left", -1: "right"}
# Half the width of the middle, as a share of the face's width.
_MIDDLE = 0.06


def place_names(face: BoundFace, vertices: IntArray) -> tuple[str, ...]:
    """Return descriptions of vertices: region, side, and the nearest bound marker.

    Left is the character's.
    """
    mesh = face.mesh
    moved = np.unique(np.concatenate([s.indices for s in mesh.shapes]))
    low, high = mesh.points[moved, 0].min(), mesh.points[moved, 0].max()
    middle, width = (low + high) / 2, max(high - low, 1e-12)
    sides = sides_of(mesh.points[vertices], middle, _MIDDLE * width)
    regions = regions_of(mesh, vertices)
    return tuple(
        _place_name(face, vertex, region, _SIDES.get(side, ""))
        for vertex, region, side in zip(vertices.tolist(), regions, sides.tolist(), strict=True)
    )


def _place_name(face: BoundFace, vertex: int, region: str, side: str) -> str:
    # In the middle there is no one brow.
    named = f"{side} {_ONE.get(region, region)}" if side else f"middle of the {region}"
    if not face.markers:
        return f"{named} (vertex {vertex})"
    away = np.linalg.norm(face.neutral - face.mesh.points[vertex], axis=1)
    nearest = int(away.argmin())
    distance = f"{1000 * away[nearest]:.0f} mm from marker {face.markers[nearest]}"
    return f"{named}, {distance} (vertex {vertex})"
