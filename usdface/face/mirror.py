"""Left and right of a face: sides of its midline, mirror images, and faces made of one half.

A rule reads markers of both sides, and often of one side only. So that a one-sided smile is
answered on its side alone, the system is evaluated three times: for the face as it is, and for
the faces that the left and the right half make with their own mirror images. Shapes of a side
follow the answer of that side. Which shapes are each other's mirror image their names say
(`usdface.face.symmetry`).
"""

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.marker_spread import marker_spread
from usdface.rigs import Mesh

__all__ = [
    "SIDES",
    "Side",
    "half_face",
    "half_weights",
    "midline",
    "mirrored_markers",
    "sided_shapes",
    "sides_of",
]

Side = Literal["both", "left", "right"]
SIDES: tuple[Side, ...] = ("both", "left", "right")
_SIGN = {"left": 1, "right": -1}
_MIRROR = np.array([-1.0, 1.0, 1.0])
_ROUNDS = 3
# In face units: how far from its mirror image a marker may sit, and how near the midline it has
# no other side.
_REACH = 0.2
_MIDLINE = 0.03
# A shape of whose motion this share is on one side belongs to it. On the faces of ICT, MakeHuman
# and the example shapes of one side have 0.83 and more there, others 0.77 at most.
_ONE_SIDED = 0.8


def sides_of(points: FloatArray, middle: float, reach: float = 0.0) -> IntArray:
    """Return 1 for points on the character's left, -1 on its right, 0 on the midline: (N,) int64.

    Parameters
    ----------
    points : (N, 3) float64 [m]
    middle : float [m]
        x of the midline, ...
    reach : float [m]
        ... and how far from it a point may be and still is on it.
    """
    beside = points[:, 0] - middle
    return np.where(np.abs(beside) < reach, 0, np.sign(beside)).astype(np.int64)


def midline(neutral: FloatArray, start: float) -> float:
    """Return x of the midline [m]: half-way between markers that are each other's mirror image.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
    start : float [m]
        Where it about is.
    """
    middle = start
    for _ in range(_ROUNDS):
        other = mirrored_markers(neutral, middle)
        paired = (other >= 0) & (other != np.arange(len(neutral)))
        if not paired.any():
            break
        middle = float(np.median((neutral[paired, 0] + neutral[other[paired], 0]) / 2))
    return middle


def mirrored_markers(neutral: FloatArray, middle: float) -> IntArray:
    """Return the marker on the other side of the face for each marker: (M,) int64.

    A marker on the midline is its own; -1 where there is none.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
        Markers on the character's neutral face, x to its left.
    middle : float [m]
        x of the midline.
    """
    unit = marker_spread(neutral)
    images = (neutral - [middle, 0.0, 0.0]) * _MIRROR + [middle, 0.0, 0.0]
    distance, other = cKDTree(neutral).query(images)
    each = np.arange(len(neutral))
    mutual = (other[other] == each) & (distance < _REACH * unit)
    found = np.where(mutual, other, -1)
    return np.where(sides_of(neutral, middle, _MIDLINE * unit) == 0, each, found)


def half_face(
    positions: FloatArray, neutral: FloatArray, at_rest: FloatArray, nose: int, side: Side
) -> FloatArray:
    """Return markers of the face that one half makes with its own mirror image: (F, M, 3) [m].

    A marker of the other half moves as the mirror image of its counterpart, one on the midline
    stays on it, and one without a counterpart moves as it does.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
    neutral : (M, 3) float64 [m]
        The same markers on the neutral face.
    at_rest : (M, 3) float64 [m]
        Their places on the character, which say who is whose mirror image.
    nose : int
        A marker near the midline.
    side : {"left", "right"}
    """
    middle = midline(at_rest, float(at_rest[nose, 0]))
    other = mirrored_markers(at_rest, middle)
    away = sides_of(at_rest, middle) == -_SIGN[side]
    each = np.arange(len(at_rest))
    half = positions.copy()
    mirrored = np.flatnonzero(away & (other >= 0) & (other != each))
    image = other[mirrored]
    half[:, mirrored] = neutral[mirrored] + _MIRROR * (positions[:, image] - neutral[image])
    central = other == each
    half[:, central, 0] = np.where(np.isnan(positions[:, central, 0]), np.nan, neutral[central, 0])
    return half


def half_weights(weights: FloatArray, pairs: IntArray, side: Side) -> FloatArray:
    """Return the weights of the face on which the other half does the same as one half: (F, S).

    Parameters
    ----------
    weights : (F, S) float64
    pairs : (P, 2) int64
        The left and the right shape of each pair.
    side : {"left", "right"}
    """
    left, right = pairs.T
    half = np.array(weights)
    if side == "left":
        half[:, right] = half[:, left]
    else:
        half[:, left] = half[:, right]
    return half


def sided_shapes(mesh: Mesh, middle: float) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the shapes that move the character's left half only, and those of the right.

    Parameters
    ----------
    mesh : Mesh
    middle : float [m]
        x of the midline.
    """
    left, right = [], []
    for shape in mesh.shapes:
        energy = (shape.offsets**2).sum(axis=1)
        side = sides_of(mesh.points[shape.indices], middle)
        whole = energy.sum()
        if energy[side > 0].sum() > _ONE_SIDED * whole:
            left.append(shape.name)
        elif energy[side < 0].sum() > _ONE_SIDED * whole:
            right.append(shape.name)
    return tuple(left), tuple(right)
