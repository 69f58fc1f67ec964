"""The error of each marker of a take, by that of the markers around it.

One marker is noisy, another slips or is bound to a wrong vertex. Squares that are weighted by the
inverse variances of their errors give the best linear estimate (Aitken 1936). Where a region moves
as the character's blend shapes cannot, all its markers are off, and a marker that moves farther
than others is off by more: that is misfit of two faces, which the solve has terms for, and no
reason to ignore the region or the marker.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.rbf import by_rows, distances
from usdface.retarget.windows import window_starts
from usdface.takes import visible

__all__ = ["LARGE_ERROR", "estimate_marker_errors", "marker_error_findings"]

# A marker's error is the largest of its means over windows of these lengths [s]: single frames
# show a spike; in long windows noise averages out, as in the solve, a slip or a drift does not. A
# marker counts where a window shows it for this share.
_WINDOWS, _SHOWN = (0.0, 0.4), 0.5
# Errors of a face are correlated in time: those within this time [s] count as one.
_ALIKE = 1.0
# Weight of the typical variance, in such times.
_PRIOR = 3.0
# Standard deviation of the head's motion, by the error: any large number.
_FREE = 1e3
# Iterations, and the relative change of a variance at which they end.
_ITERATIONS, _SETTLED = 100, 0.01
# Least variance of weights, for those that never move in the take.
_STILL = 1e-6
# Error that every marker has, as a share of the face's size (the RMS radius of its markers): below
# it none is more accurate than another. 0.02 mm on the ICT face.
_FINEST = 0.0003
# Displacements that are used: a bound on time.
_NUMBERS = 1_000_000
# Least variance, by the first guess.
_ROUNDING = 1e-6
# Markers whose median error is the usual one of a place: the shares of twice as many nearest ones
# fall to 0 with their distance, so that about as many count.
_AROUND = 6
_QUANTILES = 9  # whose mean is that of a range
# Errors up to the first number are chance or misfit, from the second on they are as found.
_CHANCE = (2.0, 3.5)
# Errors that are so many times the usual one are reported, and what was estimated with all markers
# alike is estimated anew. Set by hand.
LARGE_ERROR = 2.0


def estimate_marker_errors(
    times: FloatArray,
    weights: FloatArray,
    displaced: FloatArray,
    motion: MotionModel,
    variance: float,
) -> FloatArray:
    """Estimate the markers' errors by those of the markers around them: (M,) [1], at least 1.

    Of the most probable variances of displacements, and of their means over windows, that are the
    sum of weights, which move together as solved, the head's motion, errors of the neutral and
    independent errors: factor analysis with known loadings by expectation maximisation (D. Rubin,
    D. Thayer, "EM algorithms for ML factor analysis", Psychometrika 47, 1982). What only few
    markers show is not taken for their accuracy: the uncertainty of the weights counts. All 1 where
    nothing is left unexplained.

    Parameters
    ----------
    times : (F,) float64 [s]
    weights : (F, S) float64
        As solved.
    displaced : (F, M, 3) float64 [m]
        Displacements of the markers on the character; NaN where occluded.
    motion : MotionModel
        That the take was solved with.
    variance : float [m^2]
        Of the error of a coordinate, a first guess.
    """
    points, axes = motion.points, motion.axes
    if variance == 0.0 or len(points) <= _AROUND or not visible(displaced).any():
        return np.ones(len(points))
    some = slice(None, None, -(-displaced.size // _NUMBERS))
    times, weights, displaced = times[some], weights[some], displaced[some]
    predicted = motion.shapes.displacements(weights).reshape(displaced.shape)
    loadings = _face_loadings(weights, motion.shapes.offsets[:, motion.coordinates])
    if motion.moving_head:
        loadings = np.hstack([loadings, _FREE * np.sqrt(variance) * motion.head_basis()])
    finest = (_FINEST * rms_radius(points)) ** 2
    ways = np.linalg.norm(predicted[..., :axes], axis=2).mean(axis=0)
    found = np.ones(len(points))
    for length in _WINDOWS:
        moved, seen = _means(displaced, predicted, window_starts(times, length))
        counts = seen.mean(axis=0) * min(len(moved), float(times[-1] - times[0]) / _ALIKE)
        variances = finest + _most_probable_variances(
            moved[..., :axes], seen, loadings, counts, start=max(variance, finest)
        )
        found = np.maximum(found, np.sqrt(variances / _usual(variances, points, ways)))
    chance, sure = _CHANCE
    return np.minimum(found, 1.0 + (found - chance) * (sure - 1.0) / (sure - chance)).clip(min=1.0)


def _means(
    displaced: FloatArray, predicted: FloatArray, starts: IntArray
) -> tuple[FloatArray, BoolArray]:
    """Return means (W, M, 3) [m] over windows from frames `starts` (W,) on, and which are shown.

    Of displacements (F, M, 3), as `predicted` where they were not seen.
    """
    seen = visible(displaced)
    lengths = np.diff(np.append(starts, len(seen)))[:, None]
    counts = np.add.reduceat(seen.astype(np.float64), starts)
    left = np.add.reduceat(np.where(seen[..., None], displaced - predicted, 0.0), starts)
    # As noisy as means of whole windows, of however few frames they are.
    left /= np.sqrt(np.maximum(counts, 1.0) * lengths)[..., None]
    means = np.add.reduceat(predicted, starts) / lengths[..., None]
    return means + left, counts >= _SHOWN * lengths


def _face_loadings(weights: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return displacements (N, S) [m] by independent causes of variance 1.

    They make weights (F, S) move together as they do.
    """
    together = weights.T @ weights / len(weights) + _STILL * np.eye(weights.shape[1])
    return np.asarray(offsets.T @ np.linalg.cholesky(together))


def _most_probable_variances(
    moved: FloatArray,
    seen: BoolArray,
    loadings: FloatArray,
    counts: FloatArray,
    *,
    start: float,
) -> FloatArray:
    """Return the variance (M,) [m^2] of each marker's independent errors.

    Parameters
    ----------
    moved : (W, M, axes) float64 [m]
        Displacements in each window; as predicted where they were not seen.
    seen : (W, M) bool
    loadings : (M * axes, K) float64 [m]
    counts : (M,) float64
        Independent windows of each marker.
    start : float [m^2]
        A first guess.
    """
    flat, axes = moved.reshape(len(moved), -1), moved.shape[2]
    share, known = np.maximum(seen.mean(axis=0), 1e-12), np.repeat(seen, axes, axis=1)
    least = _ROUNDING * start  # else a marker without an error would have no inverse
    variances = np.full(seen.shape[1], start)
    for _ in range(_ITERATIONS):
        errors, spread = _expected_errors(flat, loadings, np.repeat(variances, axes))
        # An error of the whole take is noise or an expression of the neutral frames.
        errors -= np.where(known, errors, 0.0).mean(axis=0) / np.repeat(share, axes)
        squares = np.where(known, errors, 0.0).reshape(moved.shape) ** 2
        own = squares.mean(axis=(0, 2)) / share + spread.reshape(-1, axes).mean(axis=1)
        found = (counts * own + _PRIOR * float(np.median(own))) / (counts + _PRIOR)
        found = np.maximum(found, least)
        settled = np.abs(np.log(found / variances)).max() < _SETTLED
        variances = found
        if settled:
            break
    return variances


def _expected_errors(
    moved: FloatArray, loadings: FloatArray, variances: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the mean error (F, N) [m] of each coordinate, and the variance (N,) [m^2] about it.

    Of displacements `moved` (F, N) by causes and independent errors of these `variances` (N,).
    """
    weighted = loadings / variances[:, None]
    spread = np.linalg.inv(np.eye(loadings.shape[1]) + loadings.T @ weighted)
    errors = moved - moved @ weighted @ spread @ loadings.T
    return errors, ((loadings @ spread) * loadings).sum(axis=1)


def _usual(variances: FloatArray, points: FloatArray, ways: FloatArray) -> FloatArray:
    """Return the usual variance (M,) [m^2] of an error at each marker's place.

    The median of the markers around, or what a marker that moves so far is off by misfit: another
    person's chin that goes down twice as far as the lip is off by twice as much.

    Parameters
    ----------
    variances : (M,) float64 [m^2]
    points : (M, 3) float64 [m]
    ways : (M,) float64 [m]
        Mean lengths of the markers' displacements by the blend shapes.
    """

    def medians(rows: slice) -> FloatArray:
        apart = distances(points[rows], points)
        reach = np.sort(apart, axis=1)[:, min(2 * _AROUND, len(points) - 1), None]
        # Which markers are just nearest is chance: their shares fall with the distance.
        shares = (1.0 - apart / np.maximum(reach, 1e-300)).clip(min=0.0)
        own = np.arange(len(apart))
        shares[own, own + rows.start] = 0.0
        return _weighted_medians(variances, shares)

    around = by_rows(len(points), medians)
    misfit = _misfit_share(variances - variances.min(), ways) * ways**2
    return np.asarray(np.maximum(around, misfit))


def _weighted_medians(values: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the medians (M,) of values (N,) above 0, in which they count by shares (M, N).

    Geometric means of the middle third, so that none jumps where shares change a little.
    """
    order = np.argsort(values)
    counted = np.cumsum(shares[:, order], axis=1)
    middles = counted - shares[:, order] / 2
    third = np.linspace(1.0 / 3.0, 2.0 / 3.0, _QUANTILES)
    logarithms = np.log(values[order])
    rows = zip(middles, counted[:, -1], strict=True)
    return np.exp([np.interp(third * all_, own, logarithms).mean() for own, all_ in rows])


def _misfit_share(variances: FloatArray, ways: FloatArray) -> float:
    """Return the median of ``variances / ways**2``, in which markers count by their ways (M,)."""
    moving = ways > 0.0
    shares = variances[moving] / ways[moving] ** 2
    order = np.argsort(shares)
    counted = np.cumsum(ways[moving][order])
    return float(shares[order][np.searchsorted(counted, 0.5 * counted[-1])]) if len(order) else 0.0


def marker_error_findings(
    errors: FloatArray | None, names: tuple[str, ...], source: str
) -> list[Finding]:
    """Return the finding that markers count less, if the error of one is much larger than usual.

    Parameters
    ----------
    errors : (M,) float64 [1] or None
        As estimated; None = alike.
    names : tuple of str, length M
    source : str
        The take.
    """
    if errors is None or errors.max() <= LARGE_ERROR:
        return []
    large, worst = np.flatnonzero(errors > LARGE_ERROR), int(errors.argmax())
    message = (
        "markers that move unlike the face around them count less: {marker_count}, most of all "
        "{marker}, whose error is {error_ratio:.1f} times the usual one there; the cause can be "
        "noise, a marker that slipped, or a wrong vertex"
    )
    return [
        finding(
            "MARKER_INACCURATE", source, message, len(large), names[worst], errors[worst],
            markers=[names[marker] for marker in large],
        )
    ]  # fmt: skip
