"""How far the lids are closed as solved, and how far by the closing blend shape alone.

The solve uses all markers over the whole take, and so distinguishes a squint from half a blink,
which move the markers beside the eye alike.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.closure.closing_displacements import scanned_lid_displacements
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.face.bound_face import BoundFace
from usdface.takes import WeightsTake

__all__ = ["SolvedLids", "solved_lids"]


@dataclass(frozen=True, eq=False, slots=True)
class SolvedLids:
    """How far solved weights close the left and the right eye.

    Attributes
    ----------
    closed : (F, 2) float64
        Share of the opening that all blend shapes take away: 1 closed, more where the lids would
        cross; NaN in all frames of an eye whose lids are not solved.
    by_closer : (F, 2) float64
        Weight of the blend shape that closes the eye: 1 closed.
    """

    closed: FloatArray
    by_closer: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "closed", "by_closer")


def solved_lids(
    face: BoundFace, by_eye: Mapping[Eye, LidApertures], solved: WeightsTake
) -> SolvedLids:
    """Measure how far solved weights close each eye, at its widest place.

    Parameters
    ----------
    face : BoundFace
    by_eye : mapping of "left", "right" to LidApertures
        Of the blend shapes of `solved`.
    solved : WeightsTake

    Returns
    -------
    SolvedLids
        NaN for an eye that is missing, or whose blend shapes move the markers unlike people's
        (`scanned_lid_displacements`): its lids are not solved.
    """
    closed, by_closer = (np.full((len(solved.times), 2), np.nan) for _ in range(2))
    for eye, apertures in by_eye.items():
        if scanned_lid_displacements(face, apertures, solved.names):
            continue
        column = EYES.index(eye)
        neutral = float(apertures.widest(np.zeros((1, len(solved.names))))[0])
        closed[:, column] = 1.0 - apertures.widest(solved.weights) / neutral
        by_closer[:, column] = solved.weights[:, apertures.closer]
    return SolvedLids(closed, by_closer)
