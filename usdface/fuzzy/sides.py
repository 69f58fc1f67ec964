"""Left and right: what one half of a face would say if the other did the same.

A rule reads markers of both sides, and often of one side only. So that a one-sided smile is
answered on its side alone, the system is asked three times: about the face as it is, and about
the faces that the left and the right half make with their own mirror images. Shapes of a side
follow the answer of that side.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from usdface.fuzzy.features import marker_spread
from usdface.fuzzy.system import Variable
from usdface.rigs import Mesh
from usdface.takes import FloatArray, IntArray

__all__ = ["SIDES", "Side", "halved", "mirrored_markers", "sided_shapes"]

Side = Literal["both", "left", "right"]
SIDES: tuple[Side, ...] = ("both", "left", "right")
_SIGN = {"left": 1.0, "right": -1.0}
# In face units: how far from its mirror image a marker may sit, and how near the midline it has
# no other side.
_REACH = 0.2
_MIDLINE = 0.03
# A shape of whose motion this share is on one side belongs to it.
_ONE_SIDED = 0.8


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
    images = (neutral - [middle, 0.0, 0.0]) * [-1.0, 1.0, 1.0] + [middle, 0.0, 0.0]
    distance, other = cKDTree(neutral).query(images)
    each = np.arange(len(neutral))
    mutual = (other[other] == each) & (distance < _REACH * unit)
    found = np.where(mutual, other, -1)
    return np.where(np.abs(neutral[:, 0] - middle) < _MIDLINE * unit, each, found)


def halved(
    variables: Sequence[Variable],
    names: Sequence[str],
    neutral: FloatArray,
    roles: Mapping[str, str],
    nose_tip: str,
    side: Side,
) -> tuple[tuple[Variable, ...], FloatArray]:
    """Return the inputs as one half of the face has them.

    A variable that reads a marker of the other half reads its mirror image instead; where there
    is none it stays as it is.

    Parameters
    ----------
    variables : sequence of Variable, length I
    names : sequence of str, length M
        Markers.
    neutral : (M, 3) float64 [m]
        Their places on the character's neutral face.
    roles : mapping of str to str
        Role to marker.
    nose_tip : str
        Marker on the midline.
    side : {"left", "right"}

    Returns
    -------
    variables : tuple of Variable, length I
        Their roles are names of markers.
    signs : (I,) float64
        -1 where the mirror image moves the other way.
    """
    signs = np.ones(len(variables))
    read = [replace(v, role=roles.get(v.role, v.role)) for v in variables]
    if nose_tip not in names:
        return tuple(read), signs
    middle = float(neutral[list(names).index(nose_tip), 0])
    other = mirrored_markers(neutral, middle)
    index = {name: i for i, name in enumerate(names)}
    for i, variable in enumerate(read):
        marker = index.get(variable.role, -1)
        away = marker >= 0 and (neutral[marker, 0] - middle) * _SIGN[side] < 0
        if away and other[marker] not in (-1, marker):
            read[i] = replace(variable, role=names[other[marker]])
            if variable.axis == "x" and variable.measure == "signed":
                signs[i] = -1.0
    return tuple(read), signs


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
        x = mesh.points[shape.indices, 0] - middle
        whole = energy.sum()
        if energy[x > 0].sum() > _ONE_SIDED * whole:
            left.append(shape.name)
        elif energy[x < 0].sum() > _ONE_SIDED * whole:
            right.append(shape.name)
    return tuple(left), tuple(right)
