"""Blend shape weights of a whole take: bounded least squares, smooth in time.

The problem solved, for N = D'D of the marker offsets D, noise variance v and error variance
e = v + 2 misfit^2 (misfit: the difference of face and rig), is::

    min over 0 <= w <= 1 of   sum_t |D w_t - y_t|^2 / 2
                            + e / spread^2 * sum_t |w_t|^2 / 2
                            + restraint * misfit * size * sum_t |w_t|_1
                            + e * sparsity * sum_t |w_t|_1
                            + e * symmetry * sum_t sum_(i, j) (w_ti - w_tj)^2 / 2
                            + e / vergence^2 * sum_t sum_(k, l) (w_tk - w_tl)^2 / 2
                            + v * smoothness / agility * integral |w''|^2 dt / 2

with `size` the RMS radius of the face. This is the most probable take if weights are about `spread`
large, their second derivative is white with power `agility`, and markers carry white noise. So the
smoothing scales with the noise, and the ridge with the total error: on another face than the rig's,
without a ridge, pairs of large weights would cancel each other to fit the misfit. Restraint drives
shapes to 0 that explain no more than the misfit would. Misfit is correlated between neighbouring
markers, so that it counts for more than noise. Without noise and misfit each frame is solved for
itself, exactly.

Where the covariance M of the weights has been learned from the take, the ridge is of the misfit
alone and the smoothness ``v * smoothness * tr(M^-1 W' C W) / 2``, with C the inverse covariance
over time of `usdface.retarget.solver.covariance`.

Each row is a term of `usdface.retarget.solver.terms`. Sparsity and symmetry are off by default.
They too are measured against the error: weights that are exponential with mean 1 / `sparsity`, left
and right (i, j) that differ by about 1 / sqrt(`symmetry`). The two eyes' shapes (k, l) for one
direction of gaze differ by about `vergence`.
Bounds other than 0 to 1, pins and inequalities are `usdface.retarget.solver.bounds.Bounds`.
"""

from dataclasses import replace
from math import ceil

import numpy as np

from usdface.arrays import FloatArray
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.bounds import UNIT, Bounds
from usdface.retarget.solver.covariance import learn_covariance
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.temporal_solve import Iterate, solve_temporal, temporal_reach

__all__ = ["FEWEST_FRAMES", "Iterate", "reach", "solve_weights", "with_learned_covariance"]

# Smoothing below this share of the least eigenvalue is left out: it would change that direction by
# 1 % at most.
_NEGLIGIBLE = 1e-2
# Iterations of a solve that is repeated in a later round. Set by hand; docs/constants.md.
_ROUGH = 12
# Ratio of smoothing to the least eigenvalue for which `SolveOptions.iterations` are enough, as in a
# take at 30 Hz; they grow with the root of a larger one (benchmarks/README.md, solve_speed, at 60
# and 120 Hz).
_JOINED = 1500.0
# A learned covariance makes some directions slow to settle: 130 iterations are then within 4e-4 of
# 6,000 (benchmarks/README.md, solve_speed).
_LEARNED_LONGER = 1.3
# Ridge, of the trace: the rounding error of a normal matrix of some 1e3 rows (2e-16 each).
_RIDGE_FLOOR = 1e-13
# A covariance is not learned from fewer frames. Set by hand.
FEWEST_FRAMES = 8


def solve_weights(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    start: Iterate | None = None,
    rough: bool = False,
    bounds: Bounds = UNIT,
) -> Iterate:
    """Solve for the weights of all frames at once.

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        D'D, symmetric positive semi-definite.
    right : (F, S) float64 [m^2]
        D'y of every frame.
    times : (F,) float64 [s]
    regularisation : Regularisation
    start : Iterate, optional
        Where to start: the result for a similar problem.
    rough : bool
        Take a few steps towards the solution only, for a problem that will change again.
    bounds : Bounds, optional
        Pins and bounds are met exactly; 0 to 1, if left out.
    """
    system, bands, iterations = _system(normal, times, regularisation, rough)
    pull = regularisation.pulled(right)
    if not iterations:
        return Iterate(solve_bounded(system, pull, start.weights if start else None, bounds))
    options, covariance = regularisation.options, regularisation.covariance
    return solve_temporal(
        system, pull, bands, bounds, start, iterations, options.tolerance, covariance
    )


def _system(
    normal: FloatArray, times: FloatArray, regularisation: Regularisation, rough: bool
) -> tuple[FloatArray, FloatArray, int]:
    """Return normal matrix and bands of all terms, and the iterations: 0 = each frame alone."""
    options = regularisation.options
    floor = _RIDGE_FLOOR * max(normal.trace(), 1e-300)
    plain = normal + floor * np.eye(len(normal))
    unlearned = regularisation.unlearned()
    expected, bands = unlearned.added_to(plain), unlearned.bands(times)
    weakest = np.linalg.eigvalsh(expected)[0]
    if options.mode == "frame" or bands[2].max(initial=0.0) <= _NEGLIGIBLE * weakest:
        return expected, bands, 0
    # The more frames smoothing couples, the more iterations convergence takes.
    joined = float(np.sqrt(bands[2].max() / weakest / _JOINED))
    iterations = _ROUGH if rough else ceil(options.iterations * min(max(joined, 1.0), 2.0))
    if regularisation.covariance is not None:
        iterations = _ROUGH if rough else ceil(_LEARNED_LONGER * iterations)
        expected, bands = regularisation.added_to(plain), regularisation.bands(times)
    return expected, bands, iterations


def reach(
    normal: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    rounds: int,
    rows: FloatArray,
) -> int:
    """Return after how many frames the end of a take has no effect.

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        As of `solve_weights`.
    times : (F,) float64 [s]
        Of some frames at the take's rate.
    regularisation : Regularisation
    rounds : int
        Rough solves before the last one.
    rows : (C, S) float64
        Inequalities.
    """
    system, bands, iterations = _system(normal, times, regularisation, False)
    if not iterations:
        return 0
    count = iterations + rounds * _ROUGH
    return temporal_reach(system, bands, rows, count, regularisation.covariance)


def with_learned_covariance(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    start: Iterate | None = None,
) -> Regularisation:
    """Return the regularisation with the covariance of this take's weights, if it can be learned.

    Parameters are those of `solve_weights`.
    """
    options, noise = regularisation.options, regularisation.noise
    if (
        options.prior == "fixed"
        or options.mode == "frame"
        or noise == 0.0
        or len(times) < FEWEST_FRAMES
    ):
        return regularisation
    if start is None:
        start = solve_weights(normal, right, times, regularisation, rough=True)
    lasting = regularisation.lasting_variance / options.spread**2 * np.eye(len(normal))
    found = learn_covariance(normal + lasting, right, times, noise**2, options.pace, start.weights)
    return replace(regularisation, covariance=found)
