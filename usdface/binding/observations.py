"""Observations of the markers of a take: neutral, displacements in peak frames, named heights."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.face_surface import MOVING_SHARE
from usdface.binding.name_priors import NamePriors
from usdface.geometry.marker_spread import rms_radius

__all__ = ["Observations", "observe"]

# Fewer moving markers do not determine the size of a face: then all central ones are used.
_FEWEST_MOVING = 6
# Beyond this many median distances from the median marker one is not on the face: the outermost
# of a face is at 2.1 at most (the four faces of `benchmarks/binding.py`).
_CENTRAL = 3.0


@dataclass(frozen=True, eq=False)
class Observations:
    """Observations of M markers in K peak frames, the head held still.

    Attributes
    ----------
    neutral : (M, 3) float64 [m]
        In the performer's space, Y up.
    displacements : (K, M, 3) float64 [m]
        From neutral in the peak frames; 0 where occluded.
    visible : (K, M) bool
    seen : (M,) bool
        Visible in the neutral frames; other markers are at their median place.
    anchors : (M,) int64
        Index into the face surface where the vertex of a marker is given, else -1.
    heights : (M,) float64
        Height on the face by the marker's name (`usdface.binding.name_priors`), NaN = unknown.
    named : NamePriors or None
        Places by the markers' names; None where these have no known place.
    """

    neutral: FloatArray
    displacements: FloatArray
    visible: BoolArray
    seen: BoolArray
    anchors: IntArray
    heights: FloatArray
    named: NamePriors | None = None

    @cached_property
    def anchored(self) -> BoolArray:
        """(M,) bool: markers whose vertex is given."""
        return np.asarray(self.anchors >= 0)

    @cached_property
    def central(self) -> BoolArray:
        """(M,) bool: markers that are not far from all others, as on the chest."""
        away = np.linalg.norm(self.neutral - np.median(self.neutral, axis=0), axis=1)
        near: BoolArray = np.asarray(away < _CENTRAL * np.median(away))
        return near

    @cached_property
    def moving(self) -> BoolArray:
        """(M,) bool: markers that move much, by the criterion of `FaceSurface.moving`.

        Face and take are compared by the size of their moving parts, wherever else there are
        markers.
        """
        far = np.linalg.norm(self.displacements, axis=2).max(axis=0, initial=0.0)
        far = np.where(self.central, far, 0.0)
        # Relative to the second largest: a label may be on the wrong marker for a while.
        much: BoolArray = np.asarray(far > MOVING_SHARE * np.sort(far)[-2:].min(initial=np.inf))
        return much if much.sum() >= _FEWEST_MOVING else self.central

    @cached_property
    def spread(self) -> float:
        """RMS radius of the moving markers [m]."""
        return rms_radius(self.neutral[self.moving])

    def again(
        self, stabilised: FloatArray, neutral: tuple[int, int], peaks: IntArray
    ) -> "Observations":
        """Return the observations from other neutral or peak frames, as `observe` measures them."""
        return observe(
            stabilised,
            neutral,
            peaks,
            anchors=self.anchors,
            heights=self.heights,
            named=self.named,
        )


def observe(
    stabilised: FloatArray,
    neutral: tuple[int, int],
    peaks: IntArray,
    *,
    anchors: IntArray,
    heights: FloatArray,
    named: NamePriors | None = None,
) -> Observations:
    """Measure neutral markers and their displacements in the peak frames.

    Parameters
    ----------
    stabilised : (F, M, 3) float64 [m]
        Markers without head motion, NaN where occluded; each is visible in one frame at least.
    neutral : (int, int)
        First and last neutral frame index.
    peaks : (K,) int64
        Frame indices.
    anchors, heights : (M,)
        Of `Observations`.
    named : NamePriors, optional
        Of `Observations`.
    """
    window = stabilised[neutral[0] : neutral[1] + 1]
    count = (~np.isnan(window[..., 0])).sum(axis=0)[:, None]
    mean = np.nansum(window, axis=0) / np.maximum(count, 1)
    # Markers that are occluded in all neutral frames: their median place.
    mean = np.where(count > 0, mean, np.nanmedian(stabilised, axis=0))
    moves = stabilised[peaks] - mean
    visible = ~np.isnan(moves[..., 0])
    seen = count[:, 0] > 0
    return Observations(mean, np.nan_to_num(moves), visible, seen, anchors, heights, named)
