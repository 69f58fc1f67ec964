"""How far the performer's eyes are closed, measured by the markers near them.

A marker near an eye moves along with the lids, on the skin of the lid, below it or at the brow. The
displacements of the markers, carried over to the character, are projected on those that the blend
shape which closes the eye gives them (`closing_displacements`): a matched filter, 1 where they move
as far.
"""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.closing_displacements import closing_displacements, near_lids
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.face.bound_face import BoundFace
from usdface.retarget.solution import Solution
from usdface.takes import WeightsTake

__all__ = ["least_pulses", "lid_signal"]

# Least norm of all markers' displacements in a blink, in openings of the eye. Of blinks of two real
# takes on two heads 0.077 and more, of other pulses on a head with large eyes 0.06.
_LEAST = 0.07


def lid_signal(
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures],
    weights: WeightsTake,
    solution: Solution | None,
) -> FloatArray:
    """Return how far the left and the right eye are closed: (F, 2), NaN for an unmeasured eye.

    Parameters
    ----------
    face : BoundFace
    by_eye : mapping of "left", "right" to LidApertures
        For the blend shapes of `weights`.
    weights : WeightsTake
        Solved.
    solution : Solution or None
        None: `weights` are the take's own, and that of the closing shape is the signal.
    """
    signal = np.full((len(weights.times), 2), np.nan)
    for column, eye in enumerate(EYES):
        if eye not in by_eye:
            continue
        if solution is None:
            signal[:, column] = weights.weights[:, by_eye[eye].closer]
            continue
        closing = closing_displacements(face, by_eye[eye], weights.names, solution.markers)
        used = near_lids(face, by_eye[eye], closing)
        if not used.any():
            continue
        moved = solution.feature_points[:, used] - solution.rest[used]
        along = closing[used] / (closing[used] ** 2).sum()
        signal[:, column] = np.einsum("fmd,md->f", moved, along)
    return signal


def least_pulses(
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures],
    names: tuple[str, ...],
    solution: Solution,
) -> FloatArray:
    """Return the least height of a lid's pulse in the signal: (2,).

    Where the closing shape hardly moves the markers, motion of the skin alone makes smaller ones.
    """
    least = np.zeros(2)
    for column, eye in enumerate(EYES):
        if eye in by_eye:
            closing = closing_displacements(face, by_eye[eye], names, solution.markers)
            used = near_lids(face, by_eye[eye], closing)
            if used.any():
                least[column] = _LEAST * by_eye[eye].opening / np.linalg.norm(closing[used])
    return least
