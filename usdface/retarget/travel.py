"""Travel of the character's skin against that of the performer's markers, by region.

The travel ratio is the slope of a line through 0: the displacement of the skin at a marker for each
unit of the marker's, along its principal direction of motion. Over the markers m of a region and
the frames t in which they are seen, with a the marker's displacement and b the skin's, both from
their mean over the take, along that line::

    ratio = sum_mt a b / (sum_mt a^2 - N noise^2)

The N noise variances correct the denominator for the noise of the markers: without them a noisy
take would look muted (errors in variables: Fuller 1987, Measurement Error Models, 1.2).
Displacements of the markers are those of the performer without the head's motion, brought to the
size of the character by the similarity between both neutrals. Markers on skin that no blend shape
moves are left out.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.regions import regions_of
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.numerics.frame_blocks import by_blocks, frame_blocks
from usdface.retarget.solution import Solution
from usdface.takes import MarkerTake

__all__ = ["Travel", "region_travel"]

# A region rests if its markers' displacements stay below this share of the spread of all markers
# (1.5 mm on a human face), or these many deviations of the noise, in all but this share of the
# frames: sliding skin and errors of the head pose are as large. Set by hand; they only decide which
# ratios are reported.
_RESTS = 0.025
_NOISES = 3.0
_RARELY = 0.02
_FEWEST_FRAMES = 8
# Of the largest motion of any vertex by a shape: skin that moves less is not moved by it.
_UNMOVED = 1e-6


@dataclass(frozen=True, slots=True)
class Travel:
    """Travel of the skin of a region relative to the performer's markers.

    Attributes
    ----------
    markers : int
        Of the region, on skin that a blend shape moves.
    peak : float [m]
        RMS displacement of the performer's markers in the largest poses, at the character's size.
    ratio : float [1]
        Travel of the skin by that of the markers; NaN where the region rests: not determined.
    map_ratio : float [1]
        Travel of the markers mapped by the space map, likewise by that of the performer's.
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
        """The factor on the skin's travel that best fits the markers' [1]; NaN likewise.

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
    movable = np.linalg.norm(face.offsets[:, places], axis=2).max(axis=0, initial=0.0)
    follows = movable > _UNMOVED * movable.max(initial=0.0)
    regions = regions_of(face.mesh, vertices)
    groups = [
        dict(_of_regions(np.array([group(name) for name in regions]), follows))
        for group in groupings
    ]
    lines = _Lines.of(_displaced(face, take, solution, weights), solution.distances)
    sizes = lines.sizes([own for group in groups for own in group.values()])
    spread = rms_radius(face.neutral[places])
    return tuple(
        {
            region: _travel(lines, own, sizes.pop(0), spread, solution.noise)
            for region, own in group.items()
        }
        for group in groups
    )


# From frames to displacements (3, B, M, D) [m]: the performer's, mapped, and the skin's.
_Displaced = Callable[[slice], FloatArray]


def _displaced(
    face: BoundFace, take: MarkerTake, solution: Solution, weights: FloatArray
) -> _Displaced:
    places = [face.markers.index(name) for name in solution.markers]
    columns = [take.names.index(name) for name in solution.markers]
    axes = solution.dimension
    turn = np.eye(3)
    if axes == 3:
        turn, _ = similarity_fit(solution.neutral, face.neutral[places])

    def displaced(frames: slice) -> FloatArray:
        seen = ~np.isnan(solution.distances[frames])[..., None]
        mapped = solution.displaced(frames)
        performed = mapped
        if axes == 3:
            pose = solution.pose.at(frames)
            still = pose.to_head(take.positions[frames][:, columns])
            performed = np.where(seen, still - solution.neutral, 0.0) @ turn
        moved = face.displacements(weights[frames])[:, places]
        return np.where(seen, np.stack([performed, mapped, moved])[..., :axes], 0.0)

    return displaced


def _of_regions(regions: np.ndarray, follows: BoolArray) -> Iterator[tuple[str, BoolArray]]:
    for region in np.unique(regions):
        own = (regions == region) & follows
        if own.any():
            yield str(region), own


@dataclass(frozen=True, eq=False, slots=True)
class _Lines:
    """Displacements along the line of each marker, from their mean.

    `displaced` from the mean `middle` (3, M, D) [m], where `distances` (F, M) are seen; `products`
    (4, M) [m^2]: the sums over the take of a^2, a b, b^2 and a c, of the performer's displacements
    a, the skin's b and those mapped c.
    """

    displaced: _Displaced
    distances: FloatArray
    middle: FloatArray
    products: FloatArray

    @classmethod
    def of(cls, displaced: _Displaced, distances: FloatArray) -> "_Lines":
        blocks = list(frame_blocks(len(distances)))
        count = np.maximum((~np.isnan(distances)).sum(axis=0), 1)[:, None]
        middle = sum(displaced(frames).sum(axis=1) for frames in blocks) / count
        lines = cls(displaced, distances, np.asarray(middle), np.zeros(0))
        scatter = np.zeros((distances.shape[1], *middle.shape[-1:] * 2))
        for frames in blocks:
            own = lines.centred(frames)[0]
            scatter += np.einsum("fmi,fmj->mij", own, own)
        axis = np.linalg.eigh(scatter)[1][..., -1]
        products = np.zeros((4, distances.shape[1]))
        for frames in blocks:
            a, c, b = np.einsum("kfmi,mi->kfm", lines.centred(frames), axis)
            products += [(x * y).sum(axis=0) for x, y in ((a, a), (a, b), (b, b), (a, c))]
        return replace(lines, products=products)

    def centred(self, frames: slice) -> FloatArray:
        """Return displacements (3, B, M, D) from their mean; 0 where a marker is not seen."""
        seen = ~np.isnan(self.distances[frames])[..., None]
        return np.where(seen, self.displaced(frames) - self.middle[:, None], 0.0)

    def sizes(self, groups: Sequence[BoolArray]) -> list[FloatArray]:
        """Return the RMS size of the performer's displacements of some markers each (M,).

        (F,) [m] each; NaN where none is seen.
        """

        def of_groups(frames: slice) -> FloatArray:
            squares = (self.centred(frames)[0] ** 2).sum(axis=2)
            seen = ~np.isnan(self.distances[frames])
            counts = np.array([seen[:, own].sum(axis=1) for own in groups])
            sums = np.array([squares[:, own].sum(axis=1) for own in groups])
            means = np.full(sums.shape, np.nan)
            np.divide(sums, counts, out=means, where=counts > 0)
            return np.asarray(np.sqrt(means).T)

        if not groups:
            return []
        return list(by_blocks(len(self.distances), of_groups).T)


def _travel(
    lines: _Lines, own: BoolArray, sizes: FloatArray, spread: float, noise: float
) -> Travel:
    """Return the travel of the markers `own` (M,) of one region, of sizes (F,) [m]."""
    sizes = sizes[~np.isnan(sizes)]
    peak = float(np.quantile(sizes, 1.0 - _RARELY)) if len(sizes) else 0.0
    squares, both, skin, mapped = lines.products[:, own].sum(axis=1).tolist()
    seen = int((~np.isnan(lines.distances[:, own])).sum())
    squares -= seen * noise**2
    determined = (
        len(sizes) >= _FEWEST_FRAMES
        and peak > max(_RESTS * spread, _NOISES * noise)
        and squares > 0.0
    )
    count = int(own.sum())
    if not determined:
        return Travel(count, peak, np.nan, np.nan, np.nan)
    sizes_of_both = float(np.sqrt(squares * skin))
    return Travel(
        count,
        peak,
        both / squares,
        mapped / squares,
        both / sizes_of_both if sizes_of_both else 0.0,
    )
