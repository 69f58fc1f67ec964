"""Blend shape weights of a whole take: box-constrained least squares, smooth in time.

The problem solved, for N = D'D of the marker offsets D, noise variance v and error variance
e = v + 3 misfit^2 (what face and rig do not have in common), is::

    min over 0 <= w <= 1 of   sum_t |D w_t - y_t|^2 / 2
                            + e / spread^2 * sum_t |w_t|^2 / 2
                            + v * smoothness / agility * integral |w''|^2 dt / 2

which is the most probable take if weights are about `spread` large, their second
derivative is white with power `agility`, and markers carry white noise. So the smoothing
follows the noise, and the ridge the whole error: another face than the rig's asks for
shapes that nobody made, and without a ridge answers with pairs of large weights that
cancel. Misfit is alike on neighbouring markers, so that it counts for more than noise.
Without noise and misfit each frame is solved for itself, exactly.

The whole-take form is solved by ADMM (Boyd et al. 2011) with over-relaxation. One
eigen-decomposition of N turns the unconstrained step into S independent pentadiagonal
systems in time.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from usdface.options import SolveOptions
from usdface.retarget.box import solve_box
from usdface.takes import FloatArray

__all__ = ["Iterate", "curvature_bands", "error_variance", "solve_weights"]

# Where smoothing weighs less than this share of the least visible weight direction, it is left out.
_NEGLIGIBLE = 1e-2
_RELAXATION = 1.6
_ROUGH = 12
_RIDGE_FLOOR = 1e-13
# How many markers err alike; on a real face that was solved on another's rig, 2 to 6 do well.
_ALIKE = 3.0


@dataclass(frozen=True, eq=False, slots=True)
class Iterate:
    """Where a solve stands: `weights` (F, S) in [0, 1], and ADMM's scaled `dual` (F, S)."""

    weights: FloatArray
    dual: FloatArray | None = None


def solve_weights(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    noise: float,
    options: SolveOptions,
    start: Iterate | None = None,
    rough: bool = False,
    misfit: float = 0.0,
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

    Returns
    -------
    Iterate
    """
    variance = noise**2
    ridge = error_variance(noise, misfit) / options.spread**2
    floor = _RIDGE_FLOOR * max(normal.trace(), 1e-300)
    ridged = normal + (ridge + floor) * np.eye(len(normal))
    bands = curvature_bands(times) * (variance * options.smoothness / options.agility)
    weakest = np.linalg.eigvalsh(ridged)[0]
    if bands[2].max(initial=0.0) <= _NEGLIGIBLE * weakest:
        return Iterate(solve_box(ridged, right, start.weights if start else None))
    if start is None:
        start = Iterate(np.clip(np.linalg.solve(ridged, right.T).T, 0.0, 1.0))
    return _solve_take(
        ridged, right, bands, options, start, _ROUGH if rough else options.iterations
    )


def error_variance(noise: float, misfit: float) -> float:
    """Return e of the module's equation [m^2]."""
    return noise**2 + _ALIKE * misfit**2


def _solve_take(
    normal: FloatArray,
    right: FloatArray,
    bands: FloatArray,
    options: SolveOptions,
    start: Iterate,
    iterations: int,
) -> Iterate:
    # Penalty per weight: measured on the ICT face with 68 landmarks at 0.01 to 1 mm noise,
    # 60 iterations reach 5e-3 everywhere and 1e-4 in the mean.
    penalty = 0.03 * np.diag(normal) + 0.02 * bands[2].max()
    values, vectors = np.linalg.eigh(normal + np.diag(penalty))
    factors = []
    for value in values:
        system = bands.copy()
        system[2] += value
        factors.append(cholesky_banded(system, overwrite_ab=True, check_finite=False))
    boxed = start.weights
    dual = np.zeros_like(right) if start.dual is None else start.dual
    # Columns of the rotated unknowns lie together in memory: each is one banded solve.
    rotation = (penalty[:, None] * vectors).T
    constant = vectors.T @ right.T
    for _ in range(iterations):
        rotated = constant + rotation @ (boxed - dual).T
        for k, factor in enumerate(factors):
            rotated[k] = cho_solve_banded(
                (factor, False), rotated[k], overwrite_b=True, check_finite=False
            )
        relaxed = _RELAXATION * (vectors @ rotated).T + (1.0 - _RELAXATION) * boxed + dual
        previous, boxed = boxed, np.clip(relaxed, 0.0, 1.0)
        dual = relaxed - boxed
        if np.sqrt(np.mean((boxed - previous) ** 2)) < 0.1 * options.tolerance:
            break
    return Iterate(boxed, dual)


def curvature_bands(times: FloatArray) -> FloatArray:
    """Return the pentadiagonal matrix of ``integral |w''|^2 dt`` for samples at `times`.

    Returns
    -------
    (3, F) float64 [1/s^3]
        Upper banded storage, as `scipy.linalg.solveh_banded` takes it; uneven times are
        allowed, fewer than three give zeros.
    """
    count = len(times)
    bands = np.zeros((3, count))
    if count < 3:
        return bands
    step = np.diff(times)
    span = step[:-1] + step[1:]
    # w'' at an inner sample as a combination of three neighbours, times sqrt(span / 2).
    scale = np.sqrt(span / 2.0) * 2.0 / span
    left, right = scale / step[:-1], scale / step[1:]
    middle = -(left + right)
    bands[2, :-2] += left**2
    bands[2, 1:-1] += middle**2
    bands[2, 2:] += right**2
    bands[1, 1:-1] += left * middle
    bands[1, 2:] += middle * right
    bands[0, 2:] += left * right
    return bands
