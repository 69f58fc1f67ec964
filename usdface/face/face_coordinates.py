"""Coordinates on a face by its eyes, mouth and nose tip: equal numbers mean the same skin on each.

An affine map through the corners of eyes and mouth and the nose tip gives a point of any face, seen
from the front, coordinates: x from the midline to the left, y from the line of the eyes upwards,
the mouth at y = -1. Lips, and lids, that touch are near each other on the map but move differently:
each point has the side of the slit that it is on.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.face.bound_face import BoundFace

__all__ = ["FaceCoordinates", "coordinates_on"]

# On the average face (`usdface.face.marker_name_places.LANDMARKS`), by the height from mouth to
# eyes.
_EYE_INNER, _EYE_OUTER = (0.24, 0.0), (0.68, 0.0)
_MOUTH, _NOSE = (0.37, -1.0), (0.0, -0.53)
# A point is of a lip or lid up to so far from the slit, by the same height, and so far beyond its
# corners, by its width.
_NEAR = {"lips": 0.3, "lids": 0.2}
_BEYOND = 0.05


@dataclass(frozen=True, eq=False, slots=True)
class FaceCoordinates:
    """Coordinates of points on a face.

    Attributes
    ----------
    places : (N, 2) float64
        x to the left, y up; the height from mouth to eyes is 1.
    slits : (N, 2) int64
        Lips and lids: 1 above the slit, -1 below, 0 far from it.
    unit : float [m]
        The height from mouth to eyes.
    """

    places: FloatArray
    slits: IntArray
    unit: float

    def __post_init__(self) -> None:
        freeze(self, "places")
        freeze(self, "slits", dtype=np.int64)


def coordinates_on(face: BoundFace, points: FloatArray) -> FaceCoordinates | None:
    """Return where points (N, 3) [m] are on a face.

    None where its lips, lids or nose tip are not known.
    """
    mesh, layout = face.mesh.points, face.layout
    if not len(layout.lips) or not len(layout.lids) or face.nose_tip not in face.markers:
        return None
    lips = mesh[layout.lips].mean(axis=1)
    lids = mesh[layout.lids].mean(axis=1)
    eyes = [lids[s * (lids[:, 0] - face.midline) > 0] for s in (1, -1)]
    if not all(map(len, eyes)):
        return None
    known, average = [face.neutral[face.nose]], [_NOSE]
    for side, eye in zip((1, -1), eyes, strict=True):
        outwards = side * eye[:, 0]
        known += [eye[outwards.argmin()], eye[outwards.argmax()]]
        known.append(lips[(side * lips[:, 0]).argmax()])
        average += [(side * x, y) for x, y in (_EYE_INNER, _EYE_OUTER, _MOUTH)]
    corners = np.array(known)
    unit = float(corners[[1, 2, 4, 5], 1].mean() - corners[[3, 6], 1].mean())
    if unit <= 0.0:
        return None
    flat = np.c_[corners[:, :2], np.ones(len(corners))]
    affine = np.linalg.lstsq(flat, np.array(average), rcond=None)[0]
    slits = np.zeros((len(points), 2), dtype=np.int64)
    slits[:, 0] = _side_of_slit(points, lips, _NEAR["lips"] * unit)
    slits[:, 1] = sum(_side_of_slit(points, eye, _NEAR["lids"] * unit) for eye in eyes)
    return FaceCoordinates(np.c_[points[:, :2], np.ones(len(points))] @ affine, slits, unit)


def _side_of_slit(points: FloatArray, slit: FloatArray, near: float) -> IntArray:
    """Return 1 for points just above a slit (P, 3), -1 for those just below, 0 elsewhere."""
    slit = slit[slit[:, 0].argsort()]
    height = points[:, 1] - np.interp(points[:, 0], slit[:, 0], slit[:, 1])
    beyond = _BEYOND * (slit[-1, 0] - slit[0, 0])
    within = (points[:, 0] > slit[0, 0] - beyond) & (points[:, 0] < slit[-1, 0] + beyond)
    return np.where(within & (np.abs(height) < near), np.sign(height), 0).astype(np.int64)
