"""Polygons cut into triangles: as fans, or concave ones along diagonals that lie inside.

Source: G. H. Meisters, "Polygons have ears", American Mathematical Monthly 82 (1975).
"""

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["triangle_fans", "triangulated"]

_LEVEL = 1e-9  # of a polygon's area: a triangle that is thinner turns no way


def triangle_fans(face_counts: IntArray) -> tuple[IntArray, IntArray]:
    """Cut faces into fans around their first corners, concave ones, too.

    Parameters
    ----------
    face_counts : (P,) int64

    Returns
    -------
    corners : (T, 3) int64
        Face corners of each triangle.
    faces : (T,) int64
        Face that it was cut from.
    """
    counts = np.maximum(face_counts - 2, 0)
    faces = np.repeat(np.arange(len(face_counts)), counts)
    starts = (np.cumsum(face_counts) - face_counts)[faces]
    step = np.arange(len(faces)) - (np.cumsum(counts) - counts)[faces]
    return np.stack([starts, starts + step + 1, starts + step + 2], axis=1), faces


def triangulated(
    face_counts: IntArray, face_indices: IntArray, points: FloatArray
) -> tuple[IntArray, IntArray]:
    """Cut faces into triangles: fans around their first corners where these lie inside.

    Faces are cut as they are at rest, so that all shapes are cut alike.

    Parameters
    ----------
    face_counts : (P,) int64
    face_indices : (C,) int64
    points : (V, 3) float64

    Returns
    -------
    corners : (T, 3) int64
        Face corners of each triangle.
    faces : (T,) int64
        Face that it was cut from.
    """
    corners, faces = triangle_fans(face_counts)
    counts = np.maximum(face_counts - 2, 0)
    first, starts = np.cumsum(counts) - counts, np.cumsum(face_counts) - face_counts
    for face in _with_triangles_outside(corners, faces, face_indices, points).tolist():
        start, size = int(starts[face]), int(face_counts[face])
        polygon = points[face_indices[start : start + size]]
        corners[first[face] : first[face] + counts[face]] = start + _ears(polygon)
    return corners, faces


def _with_triangles_outside(
    corners: IntArray, faces: IntArray, face_indices: IntArray, points: FloatArray
) -> IntArray:
    """Return the faces of which a triangle turns the other way than the face as a whole."""
    several = np.bincount(faces)[faces] > 1 if len(faces) else np.zeros(0, bool)
    a, b, c = points[face_indices[corners[several]]].swapaxes(0, 1)
    areas = np.cross(b - a, c - a)
    own = faces[several]
    whole = np.stack([np.bincount(own, axis) for axis in areas.T], 1)[own] if len(own) else areas
    turn = (areas * whole).sum(axis=1)
    return np.unique(own[turn < -_LEVEL * (whole**2).sum(axis=1)])


def _ears(polygon: FloatArray) -> IntArray:
    """Return the triangles (N - 2, 3) of a polygon (N, 3); a fan where it crosses itself."""
    count = len(polygon)
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], 1)
    flat = _in_its_plane(polygon)
    left, cut = list(range(count)), []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(flat, left, k)), None)
        if ear is None:
            return fan
        cut.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.array([*cut, left])


def _in_its_plane(polygon: FloatArray) -> FloatArray:
    """Return a polygon (N, 3) as (N, 2), counter-clockwise."""
    following = np.roll(polygon, -1, axis=0)
    normal = np.cross(polygon - polygon[0], following - polygon[0]).sum(axis=0)
    longest = int(np.abs(normal).argmax())
    kept = polygon[:, [(longest + 1) % 3, (longest + 2) % 3]]
    return kept if normal[longest] > 0 else kept * (1, -1)


def _is_ear(flat: FloatArray, left: list[int], place: int) -> bool:
    before, here, after = left[place - 1], left[place], left[(place + 1) % len(left)]
    triangle = flat[[before, here, after]]
    if _turn(*triangle) <= 0:
        return False
    others = flat[[k for k in left if k not in (before, here, after)]]
    sides = zip(triangle, np.roll(triangle, -1, axis=0), strict=True)
    inside = np.all([_turn(one, other, others) >= 0 for one, other in sides], axis=0)
    return not inside.any()


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return twice the signed area of triangles; `c` may be many."""
    return np.asarray(
        (b[0] - a[0]) * (c[..., 1] - a[1]) - (b[1] - a[1]) * (c[..., 0] - a[0]), np.float64
    )
