"""Gap filling, from a marker's own motion and from the other markers."""

import numpy as np
from scipy.linalg import solveh_banded

from usdface.arrays import BoolArray, FloatArray
from usdface.retarget.solver.curvature import curvature_bands
from usdface.takes import frame_step

__all__ = ["OWN", "fill_gaps"]

# Time from the end of a gap within which a marker's own motion predicts it better than the other
# markers do [s]: measured on real optical takes with gaps of 0.1 to 4 s; judge:
# `python benchmarks/cleanup.py`.
OWN = 0.1
# A marker's acceleration is measured over such steps [s], over which it exceeds that of the noise.
_STEP = 0.1


def fill_gaps(
    positions: FloatArray,
    visible: BoolArray,
    predicted: FloatArray,
    *,
    known: BoolArray,
    times: FloatArray,
    noise: float,
) -> FloatArray:
    """Fill the gaps of all markers.

    Each coordinate x of a marker minimises, with y the visible and z the predicted one (moved
    so that both ends of the gap meet)::

        sum_visible (x - y)^2 / v + sum_gap (x - z)^2 dt / (q own^4) + integral |x''|^2 dt / q

    with v its noise variance and q the power of its acceleration: a natural cubic spline across
    a short gap, the prediction in the middle of a long one.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
    visible : (F, M) bool
    predicted : (F, M, 3) float64 [m]
        Each marker as the others predict it.
    known : (F,) bool
        Frames with enough visible markers for a prediction.
    times : (F,) float64 [s]
    noise : float [m]
        Standard deviation of a coordinate.

    Returns
    -------
    (F, M, 3) float64
        `positions` where they are visible.
    """
    filled = positions.copy()
    if len(times) < 3:
        return filled
    bands = curvature_bands(times)
    dt = frame_step(times)
    frames = np.arange(len(times))
    for m in np.flatnonzero(~visible.all(axis=0)):
        own, gap = visible[:, m], ~visible[:, m]
        if own.sum() < 2:
            continue
        off = positions[own, m] - predicted[own, m]
        ends = np.stack([np.interp(frames, frames[own], c) for c in off.T], axis=1)
        wanted = np.where(own[:, None], positions[:, m], predicted[:, m] + ends)
        power = _acceleration(wanted, dt, noise)
        weight = np.where(own, power / max(noise**2, 1e-5 * power * dt**3), 0.0)
        weight = np.where(gap & known, dt / OWN**4, weight)
        system = bands.copy()
        system[2] += weight
        solved = solveh_banded(system, weight[:, None] * np.nan_to_num(wanted))
        filled[gap, m] = solved[gap]
    return filled


def _acceleration(path: FloatArray, dt: float, noise: float) -> float:
    """Return the power of a path's second derivative, less that of the noise."""
    step = max(1, min(round(_STEP / dt), (len(path) - 1) // 2))
    second = path[2 * step :] - 2.0 * path[step:-step] + path[: -2 * step]
    size = float(np.mean(second**2)) - 6.0 * noise**2
    floor = max(noise**2, 1e-12 * float(np.ptp(path, axis=0).max()) ** 2, 1e-30)
    return max(size, 0.1 * floor) / (2.0 / 3.0 * (step * dt) ** 3)
