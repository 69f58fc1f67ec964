"""The space map from performer to character, by radial basis functions.

Two forms of Troy, Pranowo and Gunanto, "2D to 3D Space Transformation for Facial Animation
Based on Marker Data" (InAES 2016), [RBF] below:

* the paper's own (equations 5 to 10): exact interpolation, no polynomial term;
* neutral-relative: a similarity (2D sources: an affine map) maps the face, a
  smoothed radial field bends the remainder, and only *displacements from neutral* are used,
  so that a neutral face stays neutral and a map between equal faces is the identity. Each marker's
  displacement is mapped by the map's derivative at its neutral place: of a performer and a
  character that are bent differently, weights are a quarter nearer than with the difference of two
  mapped places (python -m benchmarks.stylised), since the field is only known where markers rest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray, freeze, frozen
from usdface.errors import SolveError
from usdface.geometry.rigid_fit import ALL_AT_ONE_PLACE, similarity_fit
from usdface.numerics.frame_blocks import by_blocks, frame_blocks
from usdface.options import Kernel, MapOptions

__all__ = [
    "SpaceMap",
    "by_rows",
    "carry",
    "distances",
    "fit_map",
    "fit_paper_map",
    "kernel_values",
    "spacing",
]

# Distances that are held at once: 64 MB.
_CHUNK_ELEMENTS = 8_000_000


def kernel_values(kernel: Kernel, distances: FloatArray, radius: float) -> FloatArray:
    """Evaluate a radial kernel at distances of any shape.

    `radius`, in their unit, is 1 over the paper's shape parameter e.
    The multiquadric is scaled by the radius, ``sqrt(d^2 + r^2)``, as in [RBF] equation 6.
    """
    ratio = (distances / radius) ** 2
    if kernel == "multiquadric":
        return radius * np.sqrt(1.0 + ratio)
    if kernel == "gaussian":
        return np.exp(-ratio)
    if kernel == "inverse_quadratic":
        return 1.0 / (1.0 + ratio)
    return 1.0 / np.sqrt(1.0 + ratio)


def kernel_slopes(kernel: Kernel, distances: FloatArray, radius: float) -> FloatArray:
    """Return the derivative of `kernel_values` by distance, divided by distance: finite at 0."""
    value = kernel_values(kernel, distances, radius)
    if kernel == "multiquadric":
        return np.asarray(1.0 / value)
    power = {"gaussian": 1, "inverse_quadratic": 2, "inverse_multiquadric": 3}[kernel]
    factor = 1.0 if kernel == "inverse_multiquadric" else 2.0
    return np.asarray(-factor / radius**2 * value**power)


@dataclass(frozen=True, eq=False)
class SpaceMap:
    """x -> x @ linear + offset + sum_i coefficients_i * kernel(|x - centres_i|).

    Attributes
    ----------
    centres : (M, D) float64
    coefficients : (M, 3) float64
    linear : (D, 3) float64
    offset : (3,) float64
    kernel : Kernel
    radius : float
        In units of the source.
    local : bool
        Displacements are mapped by the derivative at the centres, not as the difference of two
        mapped places.
    start : (M, 3) float64 or None
        Displacements of the centres themselves; None = zero.
    """

    centres: FloatArray
    coefficients: FloatArray
    linear: FloatArray
    offset: FloatArray
    kernel: Kernel
    radius: float
    local: bool = False
    start: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "centres", "coefficients", "linear", "offset", "start")

    def __call__(self, points: FloatArray) -> FloatArray:
        """Map points (..., D) of the source to (..., 3) of the target; NaN stays NaN."""
        flat = points.reshape(-1, points.shape[-1])
        result = flat @ self.linear + self.offset
        if self.coefficients.any():
            chunk = _rows_at_once(len(self.centres))
            for first in range(0, len(flat), chunk):
                rows = slice(first, first + chunk)
                values = kernel_values(
                    self.kernel, distances(flat[rows], self.centres), self.radius
                )
                result[rows] += values @ self.coefficients
        mapped: FloatArray = result.reshape(*points.shape[:-1], 3)
        return mapped

    def displacements(self, points: FloatArray) -> FloatArray:
        """Return how far mapped points (..., M, D) are from the mapped centres: (..., M, 3)."""
        if self.local:
            moved: FloatArray = np.einsum(
                "...mi,mij->...mj", points - self.centres, self.derivative
            )
        else:
            moved = self(points) - self(self.centres)
        return moved if self.start is None else moved + self.start

    @cached_property
    def derivative(self) -> FloatArray:
        """The derivative at the centres, ``d value_j / d point_i``: (M, D, 3)."""
        linear = np.repeat(self.linear[None], len(self.centres), axis=0)
        if self.coefficients.any():
            linear = linear + by_rows(len(self.centres), self._bend)
        return frozen(linear)

    def _bend(self, rows: slice) -> FloatArray:
        """Return the derivative of the radial field at some centres: (N, D, 3)."""
        own = self.centres[rows]
        slopes = kernel_slopes(self.kernel, distances(own, self.centres), self.radius)
        apart = own[:, None] - self.centres
        return np.asarray(
            np.einsum("mn,mni,nj->mij", slopes, apart, self.coefficients, optimize=True)
        )


def by_rows(count: int, compute: Callable[[slice], FloatArray]) -> FloatArray:
    """Return values of points (M, ...), computed for so many that all distances of them fit.

    Parameters
    ----------
    count : int
        M.
    compute : callable
        Returns the values of some points by their distances to all.
    """
    return by_blocks(count, compute, _rows_at_once(count))


def _rows_at_once(count: int) -> int:
    """Return for how many points the distances to `count` others are held at once."""
    return max(1, _CHUNK_ELEMENTS // max(count, 1))


def distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return all distances between (N, D) and (M, D): (N, M), without cancellation."""
    squared = np.zeros((len(a), len(b)))
    for axis in range(a.shape[1]):
        squared += (a[:, axis, None] - b[None, :, axis]) ** 2
    return np.sqrt(squared)


def _closest(points: FloatArray) -> FloatArray:
    def nearest(rows: slice) -> FloatArray:
        apart = distances(points[rows], points)
        own = np.arange(len(apart))
        apart[own, own + rows.start] = np.inf
        return np.asarray(apart.min(axis=1))

    return by_rows(len(points), nearest)


def spacing(points: FloatArray) -> float:
    """Return the mean distance of points (M, D) to their nearest neighbours."""
    return float(_closest(points).mean())


def fit_paper_map(
    source: FloatArray, target: FloatArray, kernel: Kernel = "multiquadric"
) -> SpaceMap:
    """Fit [RBF] equations 5 to 9: exact at the training pair, one radius for the whole face.

    Parameters
    ----------
    source : (M, D) float64
        Neutral markers.
    target : (M, 3) float64
        Neutral feature points of the character.
    kernel : Kernel
        One of the paper's four.

    Raises
    ------
    SolveError
        If two markers coincide, or the kernel matrix is singular to working precision.
    """
    radius = float(_closest(source).min()) if len(source) > 1 else 1.0
    if radius <= 0.0:
        raise SolveError(
            "two markers are at the same neutral place, so the paper's space map is singular; "
            'leave one out or use the form "neutral_relative"'
        )
    matrix = kernel_values(kernel, distances(source, source), radius)
    if np.linalg.cond(matrix) > 1e14:
        raise SolveError(
            f"the {kernel} space map is singular for these {len(source)} markers; use another "
            'kernel, or the form "neutral_relative"'
        )
    coefficients = np.asarray(np.linalg.solve(matrix, target), dtype=np.float64)
    dimension = source.shape[1]
    return SpaceMap(source, coefficients, np.zeros((dimension, 3)), np.zeros(3), kernel, radius)


def fit_map(source: FloatArray, target: FloatArray, options: MapOptions) -> SpaceMap:
    """Fit the map of the kernel, radius and smoothing of `options`; see `fit_paper_map`.

    In the neutral-relative form the radial field solves
    ``[[K + s I, 1], [1', 0]] [c; d] = [rest; 0]`` for the rest that the similarity leaves,
    with K the kernel matrix scaled to 1 at distance 0 and positive definite on vectors
    that sum to zero (minus the multiquadric), and s = `options.smoothing`.

    Raises
    ------
    SolveError
        If there are too few markers, or they coincide.
    """
    if options.form == "paper":
        return fit_paper_map(source, target, options.kernel)
    count = len(source)
    if count < 4:
        raise SolveError(f"the space map needs at least 4 bound markers; got {count}")
    linear, offset = carry(source, target)
    rest = target - (source @ linear + offset)
    radius = options.radius * spacing(source)
    if radius <= 0.0:
        raise SolveError(ALL_AT_ONE_PLACE)
    # Equal faces: nothing to bend, and rounding must not be amplified.
    if np.abs(rest).max() <= 1e-6 * np.abs(target - target.mean(axis=0)).max():
        none = np.zeros((count, 3))
        return SpaceMap(source, none, linear, offset, options.kernel, radius, local=True)
    sign = -1.0 / radius if options.kernel == "multiquadric" else 1.0
    system = np.ones((count + 1, count + 1))
    system[-1, -1] = 0.0
    for rows in frame_blocks(count, _rows_at_once(count)):  # into the system, which fills memory
        apart = distances(source[rows], source)
        system[rows, :-1] = sign * kernel_values(options.kernel, apart, radius)
    own = np.arange(count)
    system[own, own] += options.smoothing
    try:
        solved: FloatArray = np.asarray(np.linalg.solve(system, np.vstack([rest, np.zeros(3)])))
    except np.linalg.LinAlgError as error:
        raise SolveError(
            "the space map is singular: markers coincide; raise its smoothing"
        ) from error
    offset = np.asarray(offset + solved[-1])
    field = sign * solved[:-1]
    return SpaceMap(source, field, linear, offset, options.kernel, radius, local=True)


def carry(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit the map that the radial field bends: a similarity, or from an image (M, 2) an affine map.

    Returns
    -------
    linear : (D, 3) float64
    offset : (3,) float64
    """
    if source.shape[1] == 3:
        return similarity_fit(source, target)
    homogeneous = np.column_stack([source, np.ones(len(source))])
    solved: FloatArray = np.linalg.lstsq(homogeneous, target, rcond=None)[0].astype(np.float64)
    return solved[:-1], solved[-1]
