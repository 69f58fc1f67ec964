"""Standard deviations of the weights, undetermined shapes, and places for the next markers.

The solve is the most probable answer of a linear model with Gaussian errors, so its normal
matrix also says how far each weight can be off (Tarantola 2005, "Inverse Problem Theory",
section 3.2). Noise averages out over the frames that the smoothness joins, or the
covariance learned from the take; misfit of face and rig does not. Where the head is solved too, its
pose is unknown like the weights. Near its bounds a weight is surer (`within_bounds`).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.special import log_ndtr

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.geometry.rigid_modes import small_motions
from usdface.options import NEXT_MARKERS
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.regularisation import Regularisation

__all__ = ["Confidence", "confidence_of", "weight_deviations", "within_bounds"]

# Prior deviation of the head pose [m, rad]; a larger one costs precision where markers are few.
_HEAD = 1.0
# Least noise of a marker coordinate [m], a thirtieth of the jitter of optical markers: without any
# noise every observed shape would be certain.
_FINEST = 1e-5
# A shape is undetermined if its posterior deviation exceeds this share of the prior one: half of
# the variance.
_UNDETERMINED = 0.7
# The spectrum is integrated at so many frequencies: within 1e-3 of a dense inverse in the tests.
_FREQUENCIES = 256
# Frames that count as independent evidence of a weight, at most: half a minute. Chosen with both
# halves of the recorded curves in view (benchmarks/README.md).
_MANY = 1000
# Frames sampled for the bounds; at most twice as many.
_FRAMES = 1000
# Deviations beyond a bound from which on the tail counts as exponential (error 2 / 100^2); at more,
# the difference of squares in `within_bounds` would lose its precision (100^4 * 1e-16 = 1e-8).
_PRESSED = 100.0
# One more marker determines most of a shape if it takes away so much of its variance.
_MOST = 0.5
_LOG_BELL = -0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False, slots=True)
class Confidence:
    """The confidence of a solve: how well the markers determine each blend shape.

    Attributes
    ----------
    deviations : (S,) float64 [1]
        Standard deviation of each weight where all markers are seen, before its bounds.
    undetermined : (H,) int64
        Shapes that the markers hardly determine.
    remedies : dict of int to int or None
        Undetermined shapes that more markers would determine, each with the vertex at which one
        determines most of it; None where no single one does.
    places : (K,) int64
        The most informative vertices for the next markers, the best first (greedy D-optimal).
    """

    deviations: FloatArray
    undetermined: IntArray
    remedies: dict[int, int | None]
    places: IntArray

    def __post_init__(self) -> None:
        freeze(self, "deviations")
        freeze(self, "places", "undetermined", dtype=np.int64)


def confidence_of(
    motion: MotionModel,
    bound: IntArray,
    step: float,
    regularisation: Regularisation,
    wanted: int = NEXT_MARKERS,
    room: float = 0.0,
    errors: FloatArray | None = None,
) -> Confidence:
    """Compute the confidence of a solve.

    Parameters
    ----------
    motion : MotionModel
        Of the V places on the character where markers are or could be; linear.
    bound : (M,) int64
        The places that have a marker, as indices of these.
    step : float [s]
        Time between two frames.
    regularisation : Regularisation
        Of the solve.
    wanted : int
        Number of places for more markers to find.
    room : float [m]
        Least distance between places for more markers; fewer are found where there is no room.
    errors : (M,) float64 [1], optional
        Of the markers (`usdface.retarget.marker_errors`), 1 for more of them; equal, if left out.
    """
    points, axes, count = motion.points, motion.axes, len(motion.shapes.offsets)
    offsets, motions = motion.shapes.offsets.reshape(count, -1, 3), np.zeros((0, *points.shape))
    if motion.moving_head:
        motions = small_motions(points, axes == 2)
    # The rows of each place: a marker's displacement there by shapes and head, (V, axes, S + 6).
    rows = np.ascontiguousarray(np.concatenate([offsets, motions])[..., :axes].transpose(1, 2, 0))
    regularisation = replace(regularisation, noise=max(regularisation.noise, _FINEST))
    variance, expected = regularisation.variance, regularisation.precision(count)
    prior = block_diag(expected, np.eye(len(motions)) / _HEAD**2)
    seen = rows[bound] if errors is None else rows[bound] / errors[:, None, None]
    seen = seen.reshape(-1, rows.shape[2])
    spread = np.linalg.inv(seen.T @ seen / variance + prior)
    # The normal matrix of the weights alone, with the head's pose marginalised.
    normal = variance * (np.linalg.inv(spread[:count, :count]) - expected)
    deviations = weight_deviations(normal, step, regularisation)
    before = np.diag(np.linalg.inv(expected))
    undetermined = np.flatnonzero(np.diag(spread)[:count] > _UNDETERMINED**2 * before)
    free = np.setdiff1d(np.flatnonzero(np.abs(offsets).max(axis=(0, 2)) > 0.0), bound)
    if not len(free):
        return Confidence(deviations, undetermined, {}, np.zeros(0, np.int64))
    tried = rows[free]
    spreads, inverse = _at_places(spread, tried, variance)
    # Reduction of a shape's variance by a marker: (V, H).
    across = spreads[:, :, undetermined]
    falls = np.einsum("vah,vab,vbh->vh", across, inverse, across, optimize=True)
    best, reductions = falls.argmax(axis=0), falls.max(axis=0)
    remedies = {
        int(shape): int(free[place]) if fall >= _MOST * spread[shape, shape] else None
        for shape, place, fall in zip(undetermined, best, reductions, strict=True)
        if fall > 0.0
    }
    places = free[_greedy(spread, tried, variance, wanted, points[free], room)]
    return Confidence(deviations, undetermined, remedies, places)


def weight_deviations(
    normal: FloatArray, step: float, regularisation: Regularisation
) -> FloatArray:
    """Return the standard deviation of each weight far from both ends of a take: (S,).

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        As in `usdface.retarget.solver.solve.solve_weights`.
    step : float [s]
        Time between two frames; 0 for a single one.
    regularisation : Regularisation

    Notes
    -----
    In the eigenbasis of normal matrix and terms, N + R, the solve is a filter for each direction:
    at the frequency f [rad per frame] it divides by ``a + k``, with a the eigenvalue and k that
    of the terms that join frames. Its error is the share of the noise that passes, the loss of
    weights that move as these terms expect at a smoothness of 1, the misfit, which is slow, and
    the loss to R of weights that last and are as it expects. Without R and misfit
    this is the posterior of the whole take, without terms that join frames that of one frame. In no
    direction is a weight less sure than R alone leaves it.

    With a learned covariance M, N + R and M^-1 are diagonal in the same vectors, and k is
    the inverse of the spectrum that weights are taken to have. Misfit is taken to move as they do.
    """
    regularisation = replace(regularisation, noise=max(regularisation.noise, _FINEST))
    options, frequencies = regularisation.options, _frequencies()
    believed = replace(regularisation, options=replace(options, smoothness=1.0))
    used, prior = (held.spectrum(frequencies, step) for held in (regularisation, believed))
    if regularisation.covariance is not None:
        return _learned_deviations(normal, regularisation, regularisation.covariance, used, prior)
    variance, noise = regularisation.variance, regularisation.noise**2
    expected = regularisation.added_to(np.zeros(normal.shape))
    values, vectors = np.linalg.eigh(normal + expected)
    seen, held = (vectors.T @ matrix @ vectors for matrix in (normal, expected))
    let = 1.0 / (np.maximum(values, 0.0)[:, None] + used)
    away = np.divide(used**2, prior, out=np.zeros_like(used), where=prior > 0.0)
    slow = 1.0 / values
    errors = noise * (
        seen * (let @ let.T) / len(frequencies) + np.diag((let**2 * away).mean(axis=1))
    )
    errors += ((variance - noise) * seen + variance * held) * np.outer(slow, slow)
    # Whitened by the prior of R alone, no eigenvalue is above 1.
    root = np.linalg.cholesky(vectors.T @ regularisation.precision(len(normal)) @ vectors)
    shares, turned = np.linalg.eigh(root.T @ errors @ root)
    turned = vectors @ np.linalg.solve(root.T, turned)
    return np.asarray(np.sqrt(turned**2 @ shares.clip(0.0, 1.0)))


def _learned_deviations(
    normal: FloatArray,
    regularisation: Regularisation,
    covariance: FloatArray,
    used: FloatArray,
    prior: FloatArray,
) -> FloatArray:
    noise = regularisation.noise**2
    half = np.linalg.cholesky(covariance)
    values, turned = np.linalg.eigh(half.T @ regularisation.added_to(normal) @ half)
    vectors, values = half @ turned, values.clip(min=0.0)[:, None]
    slow = (regularisation.variance - noise) * noise * values / prior
    variances = (noise * (values + used**2 / prior) + slow) / (values + used) ** 2
    # A take is no evidence of directions that many frames together do not determine.
    expected = regularisation.precision(len(normal))
    unknown = np.linalg.inv(_MANY / noise * normal + expected)
    least, most = (np.sqrt(np.diag(m).clip(min=0.0)) for m in (unknown, np.linalg.inv(expected)))
    return np.asarray(np.sqrt(vectors**2 @ variances.mean(axis=1)).clip(least, most))


def _frequencies() -> FloatArray:
    return np.asarray(np.pi * (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES)


def within_bounds(
    deviations: FloatArray, weights: FloatArray, regularisation: Regularisation | None = None
) -> FloatArray:
    """Return the standard deviation of weights over a take, as none leaves [0, 1]: (S,).

    In each frame the error is that of a normal distribution about the weight, cut off at the
    bounds; root mean square over the frames. For a weight that a term holds at a bound, the mean of
    that distribution lies beyond the bound.

    Parameters
    ----------
    deviations : (S,) float64
        Above 0, without bounds.
    weights : (F, S) float64
        In [0, 1].
    regularisation : Regularisation, optional
        Of the solve, with the terms that hold weights at bounds.
    """
    some = weights[:: max(1, len(weights) // _FRAMES)]
    beyond = np.zeros(some.shape)
    if regularisation is not None and regularisation.variance > 0.0:
        slope = regularisation.gradient(some) / regularisation.variance
        # The mean of ``exp(-d^2 / 2 s^2 - slope * d)`` is at -slope * s^2.
        pressed = np.where(some <= 0.0, slope.clip(min=0.0), 0.0)
        pressed += np.where(some >= 1.0, slope.clip(max=0.0), 0.0)
        beyond = pressed * deviations
    near = beyond.clip(-_PRESSED, _PRESSED)
    mean, square = _cut_moments(-some / deviations + near, (1.0 - some) / deviations + near)
    # Far beyond, the tail is exponential: its mean square falls with that of the slope.
    left = (square - 2.0 * near * mean + near**2) * (near / np.where(near, beyond, 1.0)) ** 2
    left = np.where(near == 0.0, square, left)
    return np.asarray(deviations * np.sqrt(left.mean(axis=0)))


def _cut_moments(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and mean square of the standard normal distribution between two bounds."""
    mirrored = low + high > 0.0
    a, b = np.where(mirrored, -high, low), np.where(mirrored, -low, high)
    # Of the lower tail, where the share between them may be of any size.
    share = log_ndtr(b) + np.log1p(-np.exp(log_ndtr(a) - log_ndtr(b)))
    at_a, at_b = (np.exp(_LOG_BELL - 0.5 * ends**2 - share) for ends in (a, b))
    mean = at_a - at_b
    return np.where(mirrored, -mean, mean), 1.0 + a * at_a - b * at_b


def _at_places(
    spread: FloatArray, rows: FloatArray, variance: float
) -> tuple[FloatArray, FloatArray]:
    """Return rows @ spread (V, axes, N), and the inverse covariance of a marker there."""
    across = (rows.reshape(-1, len(spread)) @ spread).reshape(rows.shape)
    predicted = across @ rows.transpose(0, 2, 1)
    return across, np.asarray(np.linalg.inv(predicted + variance * np.eye(rows.shape[1])))


def _greedy(
    spread: FloatArray,
    rows: FloatArray,
    variance: float,
    wanted: int,
    points: FloatArray,
    room: float,
) -> IntArray:
    """Return the places, one after the other, that most lower the volume of the posterior."""
    chosen: list[int] = []
    taken = np.zeros(len(rows), dtype=bool)
    while len(chosen) < wanted and not taken.all():
        across, inverse = _at_places(spread, rows, variance)
        # The log determinant falls by that of the predicted covariance over the marker's own.
        falls = -np.linalg.slogdet(inverse)[1]
        falls[taken] = -np.inf
        best = int(falls.argmax())
        chosen.append(best)
        taken |= np.linalg.norm(points - points[best], axis=1) < room
        taken[best] = True
        spread = spread - across[best].T @ inverse[best] @ across[best]
    return np.array(chosen, dtype=np.int64)
