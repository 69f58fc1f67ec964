"""Places of markers on a rig's face by their names, as prior distributions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.binding.landmarks import FaceLandmarks
from usdface.face.marker_name_places import named_places
from usdface.geometry.rigid_fit import similarity_fit

__all__ = [
    "FEWEST_NAMED",
    "NamePriors",
    "NamedPose",
    "name_errors",
    "name_priors",
    "named_heights",
    "named_pose",
]

# Fewer named markers or heights determine no direction: three heights, with two names to spare.
FEWEST_NAMED, _FEWEST_HEIGHTS = 5, 3
# Degrees of freedom of the Student-t errors: one name that is wrong does not pull all.
_DEGREES_OF_FREEDOM = 4.0
# Places are those of a frontal face: depth has less weight. Set by hand.
_AXES = np.array([1.0, 1.0, 0.4])
# Rounds of fitting the pose and weighting the names, enough to settle.
_ROUNDS = 12
# Weight of names with more than one place in the first round: they follow the others.
_OPEN = 1e-3


@dataclass(frozen=True, eq=False, slots=True)
class NamePriors:
    """Prior distributions of the places of markers on a face, by their names.

    Attributes
    ----------
    points : (M, A, 3) float64 [m]
        Up to A places of each marker on the rig; NaN = none.
    spreads : (M,) float64 [m]
        Standard deviation about them; NaN where the name has no known place.
    sides : (M,) int64
        1 = left, -1 = right by the name, 0 = neither.
    middle : float [m]
        x of the rig's midline.
    """

    points: FloatArray
    spreads: FloatArray
    sides: IntArray
    middle: float

    def __post_init__(self) -> None:
        freeze(self, "points", "spreads")
        freeze(self, "sides", dtype=np.int64)

    @property
    def known(self) -> BoolArray:
        """(M,) bool: markers whose name has a known place."""
        return np.asarray(~np.isnan(self.spreads))

    def without(self, markers: BoolArray) -> "NamePriors":
        """Return the priors without those of some markers (M,)."""
        return replace(
            self,
            points=np.where(markers[:, None, None], np.nan, self.points),
            spreads=np.where(markers, np.nan, self.spreads),
            sides=np.where(markers, 0, self.sides),
        )

    def at(self, markers: BoolArray, points: FloatArray) -> "NamePriors":
        """Return the priors with some markers (M,), without a side, at given points (M, 3) [m]."""
        first = np.full_like(self.points, np.nan)
        first[:, 0] = points
        return replace(
            self,
            points=np.where(markers[:, None, None], first, self.points),
            spreads=np.where(markers, np.nanmin(self.spreads), self.spreads),
            sides=np.where(markers, 0, self.sides),
        )

    def mirrored(self) -> "NamePriors":
        """Return the priors with left for right."""
        image = self.points * [-1.0, 1.0, 1.0] + [2.0 * self.middle, 0.0, 0.0]
        points = np.where((self.sides != 0)[:, None, None], image, self.points)
        return replace(self, points=points, sides=-self.sides)


def named_heights(names: Sequence[str]) -> FloatArray:
    """Return how high each marker is on an average face by its name: (M,) [mm], NaN = unknown.

    All NaN where too few names have a known place.

    >>> named_heights(("ForeHead_M", "Chin_R1", "Leyebrow_M", "m4", "Mouth_Up", "NoseTop"))
    array([  55.,  -98.,   25.,   nan,  -58.,   -2.])
    """
    heights = np.array(
        [np.nan if place is None else place.places[0][1] for place in named_places(names)],
        dtype=np.float64,
    )
    known = heights[~np.isnan(heights)]
    if len(known) < FEWEST_NAMED or len(np.unique(known)) < _FEWEST_HEIGHTS:
        return np.full(len(names), np.nan)
    return heights


def name_priors(names: Sequence[str], landmarks: FaceLandmarks) -> NamePriors | None:
    """Carry the places of names from the average face to a rig; None where too few are known."""
    if np.isnan(named_heights(names)).all():
        return None
    places = named_places(names)
    most = max(len(place.places) for place in places if place)
    flat = np.full((len(names), most, 2), np.nan)
    for row, place in zip(flat, places, strict=True):
        if place:
            row[: len(place.places)] = place.places
    points = np.full((len(names), most, 3), np.nan)
    there = ~np.isnan(flat[..., 0])
    points[there] = landmarks.surface.points[landmarks.vertices_at(flat[there])]
    return NamePriors(
        points,
        np.array([landmarks.unit * place.spread if place else np.nan for place in places]),
        np.array([place.side if place else 0 for place in places]),
        landmarks.middle,
    )


def name_errors(priors: NamePriors, points: FloatArray) -> FloatArray:
    """Return the squared errors of M markers at N points (N, 3) [m] by their names: (M, N).

    In units of their spreads, with heavy tails; 0 where a name has no known place.
    """
    apart = np.linalg.norm((priors.points[:, :, None] - points) * _AXES, axis=3)
    nearest = np.nan_to_num(apart, nan=np.inf).min(axis=1)
    squared = np.where(priors.known[:, None], nearest / priors.spreads[:, None], 0.0) ** 2
    return np.asarray(_DEGREES_OF_FREEDOM * np.log1p(squared / _DEGREES_OF_FREEDOM))


@dataclass(frozen=True, eq=False, slots=True)
class NamedPose:
    """The similarity that maps markers to the places of their names.

    Attributes
    ----------
    linear : (3, 3) float64
    offset : (3,) float64 [m]
        Row vectors of the performer's space times `linear` plus `offset` are the character's.
    squared : (K,) float64
        Squared errors of the K markers whose names have a known place, in units of the spreads.
    """

    linear: FloatArray
    offset: FloatArray
    squared: FloatArray


def named_pose(neutral: FloatArray, priors: NamePriors) -> NamedPose:
    """Fit a similarity of neutral markers (M, 3) [m] to the places of their names.

    By iteratively reweighted least squares: names that are far off have less weight.
    """
    known = np.flatnonzero(priors.known)
    rows, source, spreads = np.arange(len(known)), neutral[known], priors.spreads[known]
    places = priors.points[known]
    target, weights = places[:, 0], np.isnan(places[:, 1:, 0]).all(axis=1).clip(_OPEN)
    for _ in range(_ROUNDS):
        linear, offset = similarity_fit(source, target, weights / spreads**2)
        mapped = source @ linear + offset
        away = np.nan_to_num(np.linalg.norm(places - mapped[:, None], axis=2), nan=np.inf)
        target = places[rows, away.argmin(axis=1)]
        squared = (away.min(axis=1) / spreads) ** 2
        weights = 1.0 / (1.0 + squared / _DEGREES_OF_FREEDOM)
    return NamedPose(linear, offset, squared)
