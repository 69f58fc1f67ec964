"""Tracks of dots: places, confidence and doubts."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.numerics.rms import rms

__all__ = ["Doubt", "Tracks"]


@dataclass(frozen=True, slots=True)
class Doubt:
    """Frames (first to last) in which a track may be that of another dot."""

    track: int
    first: int
    last: int


@dataclass(frozen=True, eq=False, slots=True)
class Tracks:
    """Dots through a film; pixel (0, 0) is the top left one, and its centre lies at (0.5, 0.5).

    Attributes
    ----------
    names : tuple of str, length M
    places : (F, M, 2) float64 [px]
        x right, y down; NaN = occluded.
    deviations : (F, M) float64 [px]
        Standard deviation of each coordinate; NaN = occluded.
    ellipses : (F, M, 3) float64
        Half axes [px] and angle [rad] of each dot; NaN = occluded.
    confidence : (F, M) float64 [1]
        0 = occluded, 1 = sure.
    reference : int
        Frame in which the dots were named.
    cuts : tuple of int
        Frames before which there is a cut.
    doubts : tuple of Doubt
    left_out : int
        Short tracks that are no markers.
    unmatched : tuple of str
        Names and corrections that no dot is near to.
    """

    names: tuple[str, ...]
    places: FloatArray
    deviations: FloatArray
    ellipses: FloatArray
    confidence: FloatArray
    reference: int = 0
    cuts: tuple[int, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    left_out: int = 0
    unmatched: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "places", "deviations", "ellipses", "confidence")

    @property
    def deviation(self) -> float:
        """Of all places [px]: root mean square."""
        return rms(self.deviations)

    @property
    def diameter(self) -> float:
        """Of the dots as they are painted [px]: dots of one film are alike.

        A slanted dot keeps its length; one that skin stretches or a lid hides is not the usual one.
        """
        seen = ~np.isnan(self.ellipses[..., 0])
        own = [np.median(self.ellipses[seen[:, k], k, 0]) for k in np.flatnonzero(seen.any(axis=0))]
        return 2.0 * float(np.median(own))
