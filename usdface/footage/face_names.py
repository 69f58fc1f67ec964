"""Names of dots from a character's binding: its bound vertices matched with the dots of one image.

A resting face is seen from the front, turned by a little, by a camera far away (an affine image of
points in space), and one face differs smoothly from another. Camera and pairs of dots and vertices
are found alternately, from soft to hard assignment (Chui and Rangarajan 2003, "A new point matching
algorithm for non-rigid registration"), from several turns of the head.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.footage.follow import HIDDEN, nearest_distances
from usdface.geometry.marker_spread import rms_radius

__all__ = ["BoundVertices", "pair_with_face"]

# Turns of a resting head that are tried [degrees], and sizes where not all dots are shown.
_YAWS, _PITCHES, _ROLLS = (-25.0, 0.0, 25.0), (-20.0, 0.0, 20.0), (-20.0, 0.0, 20.0)
_SIZES = (0.85, 1.0, 1.18)
# Reach of soft pairs, of the face's size, from step to step; a pair beyond three is none.
_REACHES = np.geomspace(0.35, 0.06, 10)
# Prior deviation of a camera from the one that is tried, of the face's size.
_CAMERA = 0.25
# Difference of two faces: deviation of a coordinate, its length scale along the face, and the
# independent deviation of each vertex, of the face's size: as binding.alignment and registration.
_BEND, _BEND_WIDTH, _OWN = 0.055, 0.7, 0.06
_BENT = 4  # rounds
# A dot has a vertex's name within this share of the distance to the vertex's nearest neighbour.
_GATE = 0.4
_FEWEST = 4


@dataclass(frozen=True, eq=False, slots=True)
class BoundVertices:
    """The vertices that markers are bound to, on a face at rest that looks along +z.

    Attributes
    ----------
    names : tuple of str, length M
        Of the markers.
    points : (M, 3) float64 [m]
        y up.
    neutral : (int, int), optional
        First and last neutral frame index, inclusive.
    """

    names: tuple[str, ...]
    points: FloatArray
    neutral: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        freeze(self, "points")


def pair_with_face(dots: FloatArray, points: FloatArray) -> IntArray:
    """Return the dot of each vertex (M,), or HIDDEN.

    Parameters
    ----------
    dots : (N, 2) float64 [px]
        x right, y down.
    points : (M, 3) float64 [m]
        Of a resting face that looks along +z, y up.
    """
    none = np.full(len(points), HIDDEN)
    if min(len(dots), len(points)) < _FEWEST:
        return none
    image = (dots - dots.mean(axis=0)) * (1.0, -1.0)
    face = points - points.mean(axis=0)
    if not (rms_radius(image) > 0.0 and rms_radius(face[:, :2]) > 0.0):
        return none
    image, face = image / rms_radius(image), face / rms_radius(face[:, :2])
    sizes = (1.0,) if len(dots) == len(points) else _SIZES
    best, shown = np.inf, face[:, :2]
    for *angles, size in product(_YAWS, _PITCHES, _ROLLS, sizes):
        start = size * Rotation.from_euler("YXZ", angles, degrees=True).as_matrix()[:2]
        placed, cost = _seen_by_camera(image, face, start)
        if cost < best:
            best, shown = cost, placed
    for _ in range(_BENT):
        shown = _bent(image, shown)
    away = np.linalg.norm(shown[:, None] - image, axis=2)
    limit = _GATE * nearest_distances(shown)
    share = np.minimum(away / limit[:, None], 1.0)
    rows, columns = linear_sum_assignment(share)
    near = share[rows, columns] < 1.0
    none[rows[near]] = columns[near]
    return none


def _seen_by_camera(
    image: FloatArray, face: FloatArray, start: FloatArray
) -> tuple[FloatArray, float]:
    """Return the face (M, 2) projected by the camera near `start` (2, 3), and its cost."""
    terms = np.column_stack([face, np.ones(len(face))])
    camera = np.column_stack([start, np.zeros(2)])
    prior = np.diag([1.0, 1.0, 1.0, 1e-6]) / _CAMERA**2
    wanted = prior @ camera.T
    shown = terms @ camera.T
    for reach in _REACHES.tolist():
        share = _soft_pairs(shown, image, reach)
        weight = share.sum(axis=1)
        normal = (terms * weight[:, None]).T @ terms / reach**2
        camera = np.linalg.solve(normal + prior, terms.T @ (share @ image) / reach**2 + wanted).T
        shown = terms @ camera.T
    away = np.linalg.norm(shown[:, None] - image, axis=2) / _REACHES[-1]
    fewer = 0 if len(image) <= len(face) else 1
    return shown, float(np.log1p(away.min(axis=1 - fewer) ** 2).mean())


def _soft_pairs(shown: FloatArray, image: FloatArray, reach: float) -> FloatArray:
    """Return soft assignments of vertices (M,) to dots (N,): rows and columns sum to 1 at most."""
    squares = ((shown[:, None] - image) ** 2).sum(axis=2) / reach**2
    share = np.exp(-0.5 * squares)
    lost = np.exp(-4.5)
    for _ in range(3):
        share = share / (share.sum(axis=1, keepdims=True) + lost)
        share = share / np.maximum(share.sum(axis=0, keepdims=True), 1.0)
    return np.asarray(share)


def _bent(image: FloatArray, shown: FloatArray) -> FloatArray:
    """Return the projected vertices (M, 2), bent smoothly towards the nearest dots."""
    share = _soft_pairs(shown, image, _OWN)
    weight = share.sum(axis=1)
    apart = ((shown[:, None] - shown) ** 2).sum(axis=2)
    bends = _BEND**2 * np.exp(-0.5 * apart / _BEND_WIDTH**2)
    noise = _OWN**2 / np.maximum(weight, 1e-6)
    pulled = (share @ image) / np.maximum(weight, 1e-6)[:, None] - shown
    return np.asarray(shown + bends @ np.linalg.solve(bends + np.diag(noise), pulled))
