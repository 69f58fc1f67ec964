"""The error of each marker of a take, by that of the markers around it.

One marker is noisy, another slips or is bound to a wrong vertex. Squares that are weighted by the
inverse variances of their errors give the best linear estimate (Aitken 1936). Where a region moves
as the character's blend shapes cannot, all its markers are off: that is misfit of two faces, which
the solve has terms for, and no reason to ignore the region.
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.takes import visible

__all__ = ["estimate_marker_errors", "marker_error_findings"]

# Errors of a face are correlated in time: frames within this time [s] count as one.
_ALIKE = 1.0
# Weight of the typical variance, in such frames.
_PRIOR = 3.0
# Standard deviation of the head's motion, by the error: any large number.
_FREE = 1e3
# Iterations, and the relative change of a variance at which they end.
_ITERATIONS, _SETTLED = 100, 0.01
# Least variance of weights, for those that never move in the take.
_STILL = 1e-6
# Error that every marker has, as a share of the face's size (the RMS radius of its markers): below
# it none is more accurate than another. 0.06 mm on the ICT face.
_FINEST = 0.001
# Nearest markers whose median error is the usual one of a place.
_AROUND = 6
# Errors that are so many times the usual one are reported.
_REPORTED = 2.0


def estimate_marker_errors(
    times: FloatArray,
    joint: PoseAndWeights,
    points: FloatArray,
    model: BlendShapeEvaluator,
    *,
    head_moves: bool,
) -> FloatArray:
    """Estimate the markers' errors by those of the markers around them: (M,) [1], at least 1.

    Of the most probable variances of displacements that are the sum of weights, which move together
    as solved, the head's motion and independent errors: factor analysis with known loadings by
    expectation maximisation (D. Rubin, D. Thayer, "EM algorithms for ML factor analysis",
    Psychometrika 47, 1982). What only few markers show is not taken for their accuracy: the
    uncertainty of the weights counts. All 1 where nothing is left unexplained.

    Parameters
    ----------
    times : (F,) float64 [s]
    joint : PoseAndWeights
        The take, solved with equal errors.
    points : (M, 3) float64 [m]
        The markers' places on the neutral character.
    model : BlendShapeEvaluator
        Of their displacements by the blend shapes: N = 3 M.
    head_moves : bool
        The head's pose was solved with the weights.
    """
    variance = joint.regularisation.variance
    seen = visible(joint.displaced)
    if variance == 0.0 or not seen.any() or len(points) <= _AROUND:
        return np.ones(len(points))
    predicted = model.displacements(joint.weights)
    left = np.where(
        seen[..., None], joint.displaced - predicted.reshape(joint.displaced.shape), 0.0
    )
    moved = predicted + left.reshape(predicted.shape)
    loadings = _loadings(joint.weights, points, model, np.sqrt(variance) if head_moves else 0.0)
    share = seen.mean(axis=0)
    counts = share * min(len(times), float(times[-1] - times[0]) / _ALIKE)
    variances = np.full(len(points), variance)
    for _ in range(_ITERATIONS):
        errors, spread = _expected_errors(moved, loadings, np.repeat(variances, 3))
        squares = np.where(seen, (errors.reshape(left.shape) ** 2).mean(axis=2), 0.0).mean(axis=0)
        own = squares / np.maximum(share, 1e-12) + spread.reshape(-1, 3).mean(axis=1)
        found = (counts * own + _PRIOR * float(np.median(own))) / (counts + _PRIOR)
        settled = np.abs(np.log(found / variances)).max() < _SETTLED
        variances = found
        if settled:
            break
    variances += (_FINEST * rms_radius(points)) ** 2
    return np.sqrt(variances / _usual(variances, points)).clip(min=1.0)


def _usual(variances: FloatArray, points: FloatArray) -> FloatArray:
    """Return the median variance of the markers around each of those at `points` (M, 3): (M,)."""
    apart = ((points[:, None] - points) ** 2).sum(axis=2)
    nearest = np.argsort(apart, axis=1, kind="stable")[:, 1 : _AROUND + 1]
    return np.asarray(np.median(variances[nearest], axis=1))


def _loadings(
    weights: FloatArray, points: FloatArray, model: BlendShapeEvaluator, free: float
) -> FloatArray:
    """Return displacements (N, K) [m] by independent causes of variance 1, those of the face first.

    Weights (F, S) move together as they are; the head moves `free` times `_FREE` [m], if at all.
    """
    together = weights.T @ weights / len(weights) + _STILL * np.eye(weights.shape[1])
    causes = model.offsets.T @ np.linalg.cholesky(together)
    if free == 0.0:
        return causes
    return np.hstack([causes, _FREE * free * motion_basis(points, 3)])


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


def marker_error_findings(errors: FloatArray, names: tuple[str, ...], source: str) -> list[Finding]:
    """Return the finding that markers count less, if the error of one is much larger than usual.

    Parameters
    ----------
    errors : (M,) float64 [1]
        As estimated.
    names : tuple of str, length M
    source : str
        The take.
    """
    large = np.flatnonzero(errors > _REPORTED)
    if not len(large):
        return []
    worst = int(errors.argmax())
    message = (
        "{marker_count} of the markers move unlike the face around them, most of all {marker}, "
        "whose error is {error_ratio:.1f} times the usual one there: they count less. The cause "
        "can be noise, a marker that slipped, or a wrong vertex"
    )
    return [
        finding(
            "MARKER_INACCURATE", source, message, len(large), names[worst], errors[worst],
            markers=[names[marker] for marker in large],
        )
    ]  # fmt: skip
