"""Left and right of a face: sides of the midline, mirror images, and mirrored halves.

A rule reads markers of both sides, often of one side only. So that a one-sided smile is corrected
on its side only, the system is evaluated three times: for the whole face, and for the left and the
right half, each mirrored to the other side. Blend shapes of a side follow the evaluation of that
half. Mirrored blend shapes are paired by name (`usdface.face.symmetry`).
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
    "marker_sides",
    "midline",
    "mirrored_markers",
    "sided_shapes",
    "sides_of",
]

Side = Literal["both", "left", "right"]
SIDES: tuple[Side, ...] = ("both", "left", "right")
_SIGN = {"left": 1, "right": -1}
_MIRROR = np.array([-1.0, 1.0, 1.0])
_ROUNDS = 3  # of pairing and median; set by hand
# [face unit]: largest distance of a marker from the mirror image of its partner, and from the
# midline of a marker on it.
_REACH = 0.2
_MIDLINE = 0.03
# A blend shape with this share of its motion on one side belongs to it. On ICT, MakeHuman
# and the example shapes of one side have 0.83 and more there, others 0.77 at most.
_ONE_SIDED = 0.8


def sides_of(points: FloatArray, middle: float, reach: float = 0.0) -> IntArray:
    """Return 1 for points on the character's left, -1 on its right, 0 on the midline: (N,) int64.

    Parameters
    ----------
    points : (N, 3) float64 [m]
    middle : float [m]
        x of the midline.
    reach : float [m]
        Points within this distance of the midline are on it.
    """
    offset = points[:, 0] - middle
    return np.where(np.abs(offset) < reach, 0, np.sign(offset)).astype(np.int64)


def marker_sides(neutral: FloatArray, middle: float) -> IntArray:
    """Return the side of each marker as `sides_of`, 0 for those near the midline: (M,) int64.

    So the rounding of a place does not decide its side.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
        Markers on the character's neutral face, x to its left.
    middle : float [m]
        x of the midline.
    """
    return sides_of(neutral, middle, _MIDLINE * marker_spread(neutral))


def midline(neutral: FloatArray, start: float) -> float:
    """Return x of the midline [m]: half-way between markers that are each other's mirror image.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
    start : float [m]
        Initial estimate.
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
    """Return the mirror partner of each marker: (M,) int64.

    A marker on the midline is its own partner; -1 = none.

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
    partner = np.where(mutual, other, -1)
    return np.where(marker_sides(neutral, middle) == 0, each, partner)


def half_face(
    positions: FloatArray, neutral: FloatArray, on_character: FloatArray, nose: int, side: Side
) -> FloatArray:
    """Return the markers of a face with one half mirrored to the other side: (F, M, 3) [m].

    A marker of the other half moves as the mirror image of its counterpart, one on the midline
    stays on it, and one without a counterpart keeps its own motion.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
    neutral : (M, 3) float64 [m]
        The same markers on the neutral face.
    on_character : (M, 3) float64 [m]
        The same markers on the character's neutral face, by which mirror partners are found.
    nose : int
        A marker near the midline.
    side : {"left", "right"}
    """
    middle = midline(on_character, float(on_character[nose, 0]))
    partner = mirrored_markers(on_character, middle)
    other_side = sides_of(on_character, middle) == -_SIGN[side]
    own = np.arange(len(on_character))
    half = positions.copy()
    mirrored = np.flatnonzero(other_side & (partner >= 0) & (partner != own))
    source = partner[mirrored]
    half[:, mirrored] = neutral[mirrored] + _MIRROR * (positions[:, source] - neutral[source])
    central = partner == own
    half[:, central, 0] = np.where(np.isnan(positions[:, central, 0]), np.nan, neutral[central, 0])
    return half


def half_weights(weights: FloatArray, pairs: IntArray, side: Side) -> FloatArray:
    """Return weights with those of one half mirrored to the other: (F, S).

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
