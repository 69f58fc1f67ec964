"""What a take says of where its markers sit: how they rest, how they move, how they are named."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.face_surface import MOVES
from usdface.geometry.marker_spread import rms_radius

__all__ = ["Evidence"]

# Fewer moving markers say nothing of the size of a face.
_FEWEST = 6


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """What a take says of its markers.

    Attributes
    ----------
    rest : (M, 3) float64
        The resting face in the performer's space, Y up.
    moves : (K, M, 3) float64
        Displacements from rest in the peak frames; 0 where not seen.
    seen : (K, M) bool
    anchors : (M,) int64
        Index into the skin where a marker's place is given, else -1.
    heights : (M,) float64
        How high on the face a marker is by its name, NaN where that does not say.
    """

    rest: FloatArray
    moves: FloatArray
    seen: BoolArray
    anchors: IntArray
    heights: FloatArray

    @property
    def central(self) -> BoolArray:
        """(M,) bool: markers that are not far from all others, as one on the chest is."""
        away = np.linalg.norm(self.rest - np.median(self.rest, axis=0), axis=1)
        near: BoolArray = np.asarray(away < 3.0 * np.median(away))
        return near

    @property
    def moving(self) -> BoolArray:
        """(M,) bool: markers that move much, as skin is chosen that does (`FaceSurface.moving`).

        The size of a face is that of its moving part on either side, wherever else it has markers.
        """
        far = np.linalg.norm(self.moves, axis=2).max(axis=0, initial=0.0)
        far = np.where(self.central, far, 0.0)
        # Of the second: one may be on the wrong marker for a while.
        much: BoolArray = np.asarray(far > MOVES * np.sort(far)[-2:].min(initial=np.inf))
        return much if much.sum() >= _FEWEST else self.central

    @property
    def spread(self) -> float:
        """RMS radius of the moving markers, which faces have in common."""
        rest = self.rest[self.moving]
        return rms_radius(rest)
