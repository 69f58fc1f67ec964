"""How sure the weights are, what the markers cannot see, and where the next markers should go.

The solve is the most probable answer of a linear model with Gaussian errors, so its normal
matrix also says how far each weight can be off (Tarantola 2005, "Inverse Problem Theory",
section 3.2). Noise averages out over the frames that the smoothness joins, or that what is learned
of the take says hang together; misfit of face and rig does not. Where the head is solved too, its
pose is unknown like the weights. Near its bounds a weight is surer (`within_bounds`).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from usdface.arrays import FloatArray, IntArray, frozen
from usdface.geometry.rigid_modes import small_motions
from usdface.options import NEXT_MARKERS
from usdface.retarget.covariance import inverse_spectrum
from usdface.retarget.regularisation import Regularisation

__all__ = ["Confidence", "confidence_of", "weight_deviations", "within_bounds"]

# The head may be anywhere within so much [m, rad]; more would cost digits where no marker is yet.
_HEAD = 1.0
# Markers are not believed beyond this [m]: without any error all that is seen is sure.
_FINEST = 1e-5
# A shape is not seen if this share of what was unknown before the take still is.
_UNSEEN = 0.7
_FREQUENCIES = 256
# How many frames may tell of a weight together.
_MANY = 1000
# Frames that are looked at for bounds, at most twice as many.
_FRAMES = 1000


@dataclass(frozen=True, eq=False, slots=True)
class Confidence:
    """What the markers say about the blend shapes.

    Attributes
    ----------
    deviations : (S,) float64 [1]
        Standard deviation of each weight where all markers are seen, before its bounds.
    unseen : dict of int to int
        Shapes that the markers say little or nothing about, each with the vertex at which one
        more marker would show it best.
    places : (K,) int64
        The vertices where the next markers would say most, the best first (greedy D-optimal).
    hidden : (H,) int64
        Shapes that the markers say little or nothing about, whether another would show them or not.
    """

    deviations: FloatArray
    unseen: dict[int, int]
    places: IntArray
    hidden: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "deviations", frozen(self.deviations))
        object.__setattr__(self, "places", frozen(self.places, np.int64))
        object.__setattr__(self, "hidden", frozen(self.hidden, np.int64))


def confidence_of(
    points: FloatArray,
    offsets: FloatArray,
    bound: IntArray,
    axes: int,
    moving_head: bool,
    step: float,
    regularisation: Regularisation,
    wanted: int = NEXT_MARKERS,
    room: float = 0.0,
) -> Confidence:
    """Say how sure a solve is.

    Parameters
    ----------
    points : (V, 3) float64 [m]
        Neutral places on the character where markers are or could be.
    offsets : (S, V, 3) float64 [m]
    bound : (M,) int64
        The places that have a marker, as indices of `points`.
    axes : int
        2 for an image's markers, which do not see depth; else 3.
    moving_head : bool
        True if the head's pose is solved with the weights.
    step : float [s]
        Time between two frames.
    regularisation : Regularisation
        Of the solve.
    wanted : int
        How many places for more markers to look for.
    room : float [m]
        How far the places for more markers must be apart; fewer are found where there is no more.
    """
    count = len(offsets)
    motions = small_motions(points, axes == 2) if moving_head else np.zeros((0, *points.shape))
    # The rows of each place: what shapes and head do to a marker there, (V, axes, S + 6).
    rows = np.ascontiguousarray(np.concatenate([offsets, motions])[..., :axes].transpose(1, 2, 0))
    regularisation = replace(regularisation, noise=max(regularisation.noise, _FINEST))
    variance, options = regularisation.variance, regularisation.options
    prior = np.concatenate([np.full(count, options.spread**-2), np.full(len(motions), _HEAD**-2)])
    seen = rows[bound].reshape(-1, rows.shape[2])
    spread = np.linalg.inv(seen.T @ seen / variance + np.diag(prior))
    # The normal matrix of the weights alone, whatever the head does.
    normal = variance * (np.linalg.inv(spread[:count, :count]) - np.diag(prior[:count]))
    deviations = weight_deviations(normal, step, regularisation)
    hidden = np.flatnonzero(np.diag(spread)[:count] > (_UNSEEN * options.spread) ** 2)
    free = np.setdiff1d(np.flatnonzero(np.abs(offsets).max(axis=(0, 2)) > 0.0), bound)
    if not len(free):
        return Confidence(deviations, {}, np.zeros(0, np.int64), hidden)
    tried = rows[free]
    spreads, inverse = _at_places(spread, tried, variance)
    # What a marker would take off the variance of a shape: (V, H).
    across = spreads[:, :, hidden]
    gains = np.einsum("vah,vab,vbh->vh", across, inverse, across, optimize=True)
    unseen = {
        int(shape): int(free[place])
        for shape, place, gain in zip(hidden, gains.argmax(axis=0), gains.max(axis=0), strict=True)
        if gain > 0.0
    }
    places = free[_greedy(spread, tried, variance, wanted, points[free], room)]
    return Confidence(deviations, unseen, places, hidden)


def weight_deviations(
    normal: FloatArray, step: float, regularisation: Regularisation
) -> FloatArray:
    """Return the standard deviation of each weight far from both ends of a take: (S,).

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        As in `usdface.retarget.solve.solve_weights`.
    step : float [s]
        Time between two frames; 0 for a single one.
    regularisation : Regularisation

    Notes
    -----
    In the eigenbasis of the normal matrix the solve is a filter for each direction: at the
    frequency f [rad per frame] it divides by ``a + c q``, with a the eigenvalue l and the ridge
    r, c the weight of the smoothness and q = (2 - 2 cos f)^2. Its error is what it lets through
    of the noise, what it takes away of weights that move as `agility` says, the misfit, which
    is slow, and a share r / a of the weight itself, which is about `spread`. Without ridge and
    misfit this is the posterior of the whole take, without smoothness that of one frame.

    With a learned covariance M, normal matrix and M^-1 are diagonal in the same vectors, and q is
    the inverse of the spectrum that weights are taken to have. Misfit is taken to move as they do.
    """
    if regularisation.covariance is not None:
        return _learned_deviations(normal, step, regularisation, regularisation.covariance)
    options, noise = regularisation.options, regularisation.noise
    values, vectors = np.linalg.eigh(normal)
    values = np.maximum(values, 0.0)[:, None]
    ridge = regularisation.ridge
    ridged = values + ridge
    curve = regularisation.stiffness / step**3 if step > 0 else 0.0
    angle = _angles()
    rough = curve * (2.0 - 2.0 * np.cos(angle)) ** 2
    passed = (values + options.smoothness * rough) / (ridged + rough) ** 2
    variances = noise**2 * passed.mean(axis=1, keepdims=True)
    slow = regularisation.variance - noise**2
    variances += (slow * values + (ridge * options.spread) ** 2) / ridged**2
    return np.asarray(np.sqrt(vectors**2 @ variances.clip(max=options.spread**2))[:, 0])


def _learned_deviations(
    normal: FloatArray, step: float, regularisation: Regularisation, covariance: FloatArray
) -> FloatArray:
    options, noise = regularisation.options, regularisation.noise
    ridged = normal + regularisation.lasting_ridge * np.eye(len(normal))
    half = np.linalg.cholesky(covariance)
    values, turned = np.linalg.eigh(half.T @ ridged @ half)
    vectors, values = half @ turned, values.clip(min=0.0)[:, None]
    inverse = inverse_spectrum(_angles(), step, options.pace)
    prior = noise**2 * inverse
    solved = values + options.smoothness * prior
    slow = (regularisation.variance - noise**2) * values / inverse
    variances = ((noise**2 * (values + options.smoothness**2 * prior) + slow) / solved**2).mean(
        axis=1
    )
    # Of what many frames together do not show, a take teaches nothing.
    unit = np.eye(len(normal))
    unknown = np.linalg.inv(_MANY / noise**2 * normal + unit / options.spread**2)
    least = np.sqrt(np.diag(unknown).clip(min=0.0))
    return np.asarray(np.sqrt(vectors**2 @ variances).clip(least, options.spread))


def _angles() -> FloatArray:
    return np.asarray(np.pi * (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES)


def within_bounds(deviations: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the standard deviation of weights over a take, as none leaves [0, 1]: (S,).

    In each frame the error is that of a normal distribution about the weight, cut off at the
    bounds; root mean square over the frames.

    Parameters
    ----------
    deviations : (S,) float64
        Above 0, without bounds.
    weights : (F, S) float64
        In [0, 1].
    """
    some = weights[:: max(1, len(weights) // _FRAMES)]
    low, high = -some / deviations, (1.0 - some) / deviations
    cut = low * _bell(low) - high * _bell(high)
    left = 1.0 + cut / (ndtr(high) - ndtr(low))
    return np.asarray(deviations * np.sqrt(left.mean(axis=0)))


def _bell(values: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-0.5 * values**2) / np.sqrt(2.0 * np.pi))


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
    """Return the places, one after the other, that most lower the volume of what is unknown."""
    chosen: list[int] = []
    taken = np.zeros(len(rows), dtype=bool)
    while len(chosen) < wanted and not taken.all():
        across, inverse = _at_places(spread, rows, variance)
        # The log determinant falls by that of the predicted covariance over the marker's own.
        gains = -np.linalg.slogdet(inverse)[1]
        gains[taken] = -np.inf
        best = int(gains.argmax())
        chosen.append(best)
        taken |= np.linalg.norm(points - points[best], axis=1) < room
        taken[best] = True
        spread = spread - across[best].T @ inverse[best] @ across[best]
    return np.array(chosen, dtype=np.int64)
