"""Blend shape weights of a whole take: bounded least squares, smooth in time.

The problem solved, for N = D'D of the marker offsets D, noise variance v and error variance
e = v + 5 misfit^2 (what face and rig do not have in common), is::

    min over 0 <= w <= 1 of   sum_t |D w_t - y_t|^2 / 2
                            + e / spread^2 * sum_t |w_t|^2 / 2
                            + e * sparsity * sum_t |w_t|_1
                            + e * symmetry * sum_t sum_(i, j) (w_ti - w_tj)^2 / 2
                            + v * smoothness / agility * integral |w''|^2 dt / 2

which is the most probable take if weights are about `spread` large, their second
derivative is white with power `agility`, and markers carry white noise. So the smoothing
follows the noise, and the ridge the whole error: another face than the rig's asks for
shapes that nobody made, and without a ridge answers with pairs of large weights that
cancel. Misfit is alike on neighbouring markers, so that it counts for more than noise.
Without noise and misfit each frame is solved for itself, exactly.

Where the covariance M of the weights has been learned from the take, the ridge is of the misfit
alone and the smoothness ``v * smoothness * tr(M^-1 W' C W) / 2``, with C the inverse covariance
over time of `usdface.retarget.covariance`.

Sparsity and symmetry are off by default. They too are measured against the error: weights that
are exponential with mean 1 / `sparsity`, left and right that differ by about 1 / sqrt(`symmetry`).
Bounds other than 0 to 1, pins and inequalities are `usdface.retarget.bounds.Bounds`.
"""

from math import ceil

import numpy as np

from usdface.options import SolveOptions
from usdface.retarget.bounds import UNIT, Bounds
from usdface.retarget.box import solve_box
from usdface.retarget.covariance import inverse_bands, learn_covariance
from usdface.retarget.spacetime import Iterate, curvature_bands, solve_spacetime
from usdface.takes import FloatArray, IntArray

__all__ = [
    "Iterate",
    "error_variance",
    "learned_covariance",
    "solve_weights",
    "systematic_ridge",
]

# Where smoothing weighs less than this share of the least visible weight direction, it is left out.
_NEGLIGIBLE = 1e-2
_ROUGH = 12
# Stiffness over the weakest direction of a take at 30 Hz: enough iterations are stated for it.
_JOINED = 1500.0
# A learned covariance makes some directions slow to settle.
_LEARNED_LONGER = 1.3
_RIDGE_FLOOR = 1e-13
# How many markers err alike; 3 to 12 do well on performers with other movements than the rig's.
_ALIKE = 5.0
# Too short a take says nothing about its weights.
_FEWEST = 8


def solve_weights(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    noise: float,
    options: SolveOptions,
    start: Iterate | None = None,
    rough: bool = False,
    misfit: float = 0.0,
    bounds: Bounds = UNIT,
    pairs: IntArray | None = None,
    covariance: FloatArray | None = None,
) -> Iterate:
    """Solve for the weights of all frames at once.

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        D'D, symmetric positive semi-definite.
    right : (F, S) float64 [m^2]
        D'y of every frame.
    times : (F,) float64 [s]
    noise : float [m]
        Standard deviation of a marker coordinate.
    options : SolveOptions
    start : Iterate, optional
        Where to start: the result for a similar problem.
    rough : bool
        Take a few steps towards the solution only, for a problem that will change again.
    misfit : float [m]
        RMS error of a marker coordinate beyond the noise.
    bounds : Bounds, optional
        Pins and bounds are met exactly; 0 to 1, if left out.
    pairs : (P, 2) int64, optional
        Left and right shapes that `options.symmetry` is about, see
        `usdface.retarget.symmetry.symmetric_pairs`.
    covariance : (S, S) float64, optional
        M of `learned_covariance`, where it is known; it takes the place of `agility`, and of the
        ridge for noise, where frames are solved together.

    Returns
    -------
    Iterate
    """
    error = error_variance(noise, misfit)
    floor = _RIDGE_FLOOR * max(normal.trace(), 1e-300)
    plain = normal + floor * np.eye(len(normal))
    if options.symmetry and pairs is not None:
        difference = _differences(pairs, len(normal))
        plain += error * options.symmetry * difference.T @ difference
    ridged = plain + error / options.spread**2 * np.eye(len(normal))
    # The weights' sum is their L1 norm where they are 0 or more, as they are by default.
    pull = right - error * options.sparsity if options.sparsity else right
    bands = curvature_bands(times) * (noise**2 * options.smoothness / options.agility)
    weakest = np.linalg.eigvalsh(ridged)[0]
    alone = options.mode == "frame" or bands[2].max(initial=0.0) <= _NEGLIGIBLE * weakest
    if alone:
        return Iterate(solve_box(ridged, pull, start.weights if start else None, bounds))
    # The more frames smoothing joins, the longer it takes until all of them know.
    joined = float(np.sqrt(bands[2].max() / weakest / _JOINED))
    iterations = _ROUGH if rough else ceil(options.iterations * min(max(joined, 1.0), 2.0))
    if covariance is not None:
        iterations = _ROUGH if rough else ceil(_LEARNED_LONGER * iterations)
        bands = noise**2 * options.smoothness * inverse_bands(times, options.pace)
        ridged = plain + systematic_ridge(misfit, options) * np.eye(len(normal))
    return solve_spacetime(
        ridged, pull, bands, bounds, start, iterations, options.tolerance, covariance
    )


def learned_covariance(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    noise: float,
    options: SolveOptions,
    start: Iterate | None = None,
    misfit: float = 0.0,
) -> FloatArray | None:
    """Return the covariance of a take's weights for `solve_weights`; None where it would not serve.

    Parameters are those of `solve_weights`.
    """
    if options.prior == "fixed" or options.mode == "frame" or noise == 0.0 or len(times) < _FEWEST:
        return None
    if start is None:
        start = solve_weights(normal, right, times, noise, options, None, True, misfit)
    ridged = normal + systematic_ridge(misfit, options) * np.eye(len(normal))
    return learn_covariance(ridged, right, times, noise**2, options, start.weights)


def _differences(pairs: IntArray, size: int) -> FloatArray:
    rows = np.zeros((len(pairs), size))
    rows[np.arange(len(pairs)), pairs[:, 0]] = 1.0
    rows[np.arange(len(pairs)), pairs[:, 1]] = -1.0
    return rows


def error_variance(noise: float, misfit: float) -> float:
    """Return e of the module's equation [m^2]."""
    return noise**2 + _ALIKE * misfit**2


def systematic_ridge(misfit: float, options: SolveOptions) -> float:
    """Return the ridge that does not average out over frames [m^2]."""
    return _ALIKE * misfit**2 / options.spread**2
