"""How far the performer's eyes are closed, as far as the markers show it.

A marker near an eye moves along with the lids, on the skin of the lid, below it or at the brow. The
displacements of the markers, carried over to the character, are projected on those that the blend
shape which closes the eye gives them: a matched filter, 1 where they move as far.
"""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.closure.lid_gaps import EYES, Eye, LidGaps
from usdface.face.bound_face import BoundFace
from usdface.retarget.solution import Solution
from usdface.takes import WeightsTake

__all__ = ["closing_displacements", "least_pulses", "lid_signal", "near_lids"]

# A marker that the closing shape moves by less, as a share of the farthest, does not count.
_MOVED = 0.15
# Openings of the eye: if the closing shape moves no marker by as much, none is near the lids.
# AnimFace's markers on the lids move by 0.48 on ICT, landmarks on the rims by 1.
_NEAR = 0.1
# Openings of the eye by which a blink moves the markers together at least. Of blinks of two real
# takes on two heads 0.077 and more, of other pulses on a head with large eyes 0.06.
_LEAST = 0.07


def lid_signal(
    face: BoundFace,
    gaps: Mapping[Eye, LidGaps],
    weights: WeightsTake,
    solution: Solution | None,
) -> FloatArray:
    """Return how far the left and the right eye are closed: (F, 2), NaN where nothing shows it.

    Parameters
    ----------
    face : BoundFace
    gaps : mapping of "left", "right" to LidGaps
        For the blend shapes of `weights`.
    weights : WeightsTake
        Solved.
    solution : Solution or None
        None: `weights` are the take's own, and say it.
    """
    signal = np.full((len(weights.times), 2), np.nan)
    for column, eye in enumerate(EYES):
        if eye not in gaps:
            continue
        if solution is None:
            signal[:, column] = weights.weights[:, gaps[eye].closer]
            continue
        closing = closing_displacements(face, gaps[eye], weights.names, solution.markers)
        used = near_lids(closing, gaps[eye])
        if not used.any():
            continue
        moved = solution.feature_points[:, used] - solution.rest[used]
        along = closing[used] / (closing[used] ** 2).sum()
        signal[:, column] = np.einsum("fmd,md->f", moved, along)
    return signal


def closing_displacements(
    face: BoundFace, gaps: LidGaps, names: tuple[str, ...], markers: tuple[str, ...]
) -> FloatArray:
    """Return the displacement of each marker by the shape that closes an eye: (M, 3) [m].

    `gaps` are of the blend shapes `names`.
    """
    shape = face.shape_names.index(names[gaps.closer])
    order = [face.markers.index(name) for name in markers]
    return np.asarray(face.offsets[shape][order])


def least_pulses(
    face: BoundFace, gaps: Mapping[Eye, LidGaps], names: tuple[str, ...], solution: Solution
) -> FloatArray:
    """Return the least pulse of the signal that lids make: (2,).

    Where the closing shape hardly moves the markers, the skin alone moves them as far.
    """
    least = np.zeros(2)
    for column, eye in enumerate(EYES):
        if eye in gaps:
            closing = closing_displacements(face, gaps[eye], names, solution.markers)
            used = near_lids(closing, gaps[eye])
            if used.any():
                least[column] = _LEAST * gaps[eye].opening / np.linalg.norm(closing[used])
    return least


def near_lids(closing: FloatArray, gaps: LidGaps) -> BoolArray:
    """Return which markers the lids of an eye move: (M,), by their closing displacements (M, 3)."""
    size = np.linalg.norm(closing, axis=1)
    farthest = size.max(initial=0.0)
    return np.asarray((farthest >= _NEAR * gaps.opening) & (size >= _MOVED * farthest))
