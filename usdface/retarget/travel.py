"""Travel of the character's skin against that of the performer's markers, by region.

The travel ratio is the slope of a line through 0: how far the skin at a marker goes for each unit
that the marker goes, along the line on which it moves most. Over the markers m of a region and the
frames t in which they are seen, with a the marker's displacement and b the skin's, both from their
mean over the take, along that line::

    ratio = sum_mt a b / (sum_mt a^2 - N noise^2)

The N noise variances in the denominator are what the noise of the markers adds to it: without them
a noisy take would look muted (errors in variables: Fuller 1987, Measurement Error Models, 1.2).
Displacements of the markers are those of the performer without the head's motion, brought to the
size of the character by the similarity between both neutrals. Markers on skin that no blend shape
moves are left out.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.regions import regions_of
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.retarget.solution import Solution
from usdface.takes import MarkerTake

__all__ = ["Travel", "region_travel"]

# A region rests if its markers go no further than this share of the spread of all markers (1.5 mm
# on a human face), or these many deviations of the noise, but for this share of the frames: skin
# slides and head poses err by as much. Set by hand; they only decide which ratios are reported.
_RESTS = 0.025
_NOISES = 3.0
_RARELY = 0.02
_FEWEST_FRAMES = 8
# Of the largest motion of any vertex by a shape: skin that moves less is not moved by it.
_UNMOVED = 1e-6


@dataclass(frozen=True, slots=True)
class Travel:
    """How far the skin of a region goes for the markers of the performer.

    Attributes
    ----------
    markers : int
        Of the region, on skin that a blend shape moves.
    peak : float [m]
        RMS displacement of the performer's markers in the largest poses, at the character's size.
    ratio : float [1]
        Travel of the skin by that of the markers; NaN where the region rests: not determined.
    map_ratio : float [1]
        Travel of the markers carried over by the space map, likewise by that of the performer's.
    correlation : float [1]
        Of both travels: near 1 where the skin follows, however little it moves.
    """

    markers: int
    peak: float
    ratio: float
    map_ratio: float
    correlation: float

    @property
    def best_factor(self) -> float:
        """The factor on the skin's travel that comes nearest to the markers' [1]; NaN likewise.

        In least squares: correlation^2 / ratio, so that motion that does not follow the markers is
        not enlarged.
        """
        return self.correlation**2 / self.ratio if self.ratio > 0 else np.nan


def region_travel(
    face: BoundFace,
    take: MarkerTake,
    solution: Solution,
    weights: FloatArray,
    *groupings: Callable[[str], str],
) -> tuple[dict[str, Travel], ...]:
    """Measure the travel of each region.

    Parameters
    ----------
    face : BoundFace
    take : MarkerTake
        As solved.
    solution : Solution
    weights : (F, S) float64
        Of the face's blend shapes: those of the solution, exaggerated or corrected.
    *groupings : callable
        Each merges regions: returns the region that one of `usdface.face.regions.REGIONS` counts
        to; `str` keeps them.

    Returns
    -------
    tuple of dict
        One for each grouping.
    """
    places = [face.markers.index(name) for name in solution.markers]
    vertices = face.vertices_of(solution.markers)
    seen = ~np.isnan(solution.distances)
    carried = solution.displacements
    performed = carried
    if solution.in_space:
        turn, _ = similarity_fit(solution.neutral, face.neutral[places])
        still = solution.pose.to_head(take.select(solution.markers))
        performed = np.where(seen[..., None], still - solution.neutral, 0.0) @ turn
    moved = face.displacements(weights)[:, places]
    axes = 3 if solution.in_space else 2
    lines = _Lines.of(performed[..., :axes], carried[..., :axes], moved[..., :axes], seen)
    movable = np.linalg.norm(face.offsets[:, places], axis=2).max(axis=0, initial=0.0)
    follows = movable > _UNMOVED * movable.max(initial=0.0)
    spread = rms_radius(face.neutral[places])
    regions = regions_of(face.mesh, vertices)
    return tuple(
        {
            region: _travel(lines.select(own), spread, solution.noise)
            for region, own in _of_regions(np.array([group(name) for name in regions]), follows)
        }
        for group in groupings
    )


def _of_regions(regions: np.ndarray, follows: BoolArray) -> Iterator[tuple[str, BoolArray]]:
    for region in np.unique(regions):
        own = (regions == region) & follows
        if own.any():
            yield str(region), own


@dataclass(frozen=True, eq=False, slots=True)
class _Lines:
    """Displacements along the line of each marker, from their mean; 0 where it is not seen.

    `performed`, `carried` and `moved` are (F, M) [m]; `sizes` (F, M) [m] of the performer's
    displacement in all directions; `seen` (F, M).
    """

    performed: FloatArray
    carried: FloatArray
    moved: FloatArray
    sizes: FloatArray
    seen: BoolArray

    @classmethod
    def of(
        cls, performed: FloatArray, carried: FloatArray, moved: FloatArray, seen: BoolArray
    ) -> "_Lines":
        count = np.maximum(seen.sum(axis=0), 1)[:, None]

        def centred(values: FloatArray) -> FloatArray:
            shown = np.where(seen[..., None], values, 0.0)
            return np.where(seen[..., None], shown - shown.sum(axis=0) / count, 0.0)

        own = centred(performed)
        scatter = np.einsum("fmi,fmj->mij", own, own)
        axis = np.linalg.eigh(scatter)[1][..., -1]

        def along(values: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("fmi,mi->fm", centred(values), axis))

        return cls(along(own), along(carried), along(moved), np.linalg.norm(own, axis=2), seen)

    def select(self, markers: BoolArray) -> "_Lines":
        return _Lines(
            self.performed[:, markers],
            self.carried[:, markers],
            self.moved[:, markers],
            self.sizes[:, markers],
            self.seen[:, markers],
        )


def _travel(lines: _Lines, spread: float, noise: float) -> Travel:
    """Return the travel of the markers of one region."""
    count = lines.seen.sum(axis=1)
    shown = count > 0
    sizes = np.sqrt((lines.sizes**2).sum(axis=1)[shown] / count[shown])
    peak = float(np.quantile(sizes, 1.0 - _RARELY)) if shown.any() else 0.0
    a, b = lines.performed, lines.moved
    squares = float((a**2).sum()) - int(lines.seen.sum()) * noise**2
    determined = (
        shown.sum() >= _FEWEST_FRAMES
        and peak > max(_RESTS * spread, _NOISES * noise)
        and squares > 0.0
    )
    if not determined:
        return Travel(lines.seen.shape[1], peak, np.nan, np.nan, np.nan)
    both = float((a * b).sum())
    sizes_of_both = float(np.sqrt(squares * (b**2).sum()))
    return Travel(
        lines.seen.shape[1],
        peak,
        both / squares,
        float((a * lines.carried).sum()) / squares,
        both / sizes_of_both if sizes_of_both else 0.0,
    )
