"""Gaps: what a marker did while it was lost, from its own motion and from the other markers."""

import numpy as np
from scipy.linalg import solveh_banded

from usdface.arrays import BoolArray, FloatArray
from usdface.retarget.curvature import curvature_bands

__all__ = ["fill", "runs"]

# Seconds from the end of a gap in which a marker's own motion says more than the others do:
# measured on real optical takes, with 0.1 to 4 s of gap.
_OWN = 0.1
# A marker's acceleration is measured over such steps [s], which noise does not decide.
_STEP = 0.1


def fill(
    still: FloatArray,
    seen: BoolArray,
    told: FloatArray,
    known: BoolArray,
    times: FloatArray,
    noise: float,
) -> FloatArray:
    """Fill the gaps of all markers.

    Each coordinate x of a marker minimises, with y where it was seen and z what the others say
    (moved so that both ends of the gap meet)::

        sum_seen (x - y)^2 / v + sum_gap (x - z)^2 dt / (q own^4) + integral |x''|^2 dt / q

    with v its noise variance and q the power of its acceleration: a natural cubic spline across
    a short gap, what the others say in the middle of a long one.

    Parameters
    ----------
    still : (F, M, 3) float64
    seen : (F, M) bool
    told : (F, M, 3) float64
        What the other markers say of each.
    known : (F,) bool
        Frames in which enough others were seen to say something.
    times : (F,) float64 [s]
    noise : float
        Standard deviation of a coordinate.

    Returns
    -------
    (F, M, 3) float64
        `still` where it was seen.
    """
    filled = still.copy()
    if len(times) < 3:
        return filled
    bands = curvature_bands(times)
    dt = float(np.median(np.diff(times)))
    frames = np.arange(len(times))
    for m in np.flatnonzero(~seen.all(axis=0)):
        own, gap = seen[:, m], ~seen[:, m]
        if own.sum() < 2:
            continue
        off = still[own, m] - told[own, m]
        ends = np.stack([np.interp(frames, frames[own], c) for c in off.T], axis=1)
        wanted = np.where(own[:, None], still[:, m], told[:, m] + ends)
        power = _acceleration(wanted, dt, noise)
        weight = np.where(own, power / max(noise**2, 1e-5 * power * dt**3), 0.0)
        weight = np.where(gap & known, dt / _OWN**4, weight)
        system = bands.copy()
        system[2] += weight
        solved = solveh_banded(system, weight[:, None] * np.nan_to_num(wanted))
        filled[gap, m] = solved[gap]
    return filled


def _acceleration(path: FloatArray, dt: float, noise: float) -> float:
    """Return the power of a path's second derivative, without what `noise` adds to it."""
    step = max(1, min(round(_STEP / dt), (len(path) - 1) // 2))
    second = path[2 * step :] - 2.0 * path[step:-step] + path[: -2 * step]
    size = float(np.mean(second**2)) - 6.0 * noise**2
    floor = max(noise**2, 1e-12 * float(np.ptp(path, axis=0).max()) ** 2, 1e-30)
    return max(size, 0.1 * floor) / (2.0 / 3.0 * (step * dt) ** 3)


def runs(where: BoolArray) -> list[tuple[int, int]]:
    """Return first and last frame of each run of True in `where` (F,)."""
    padded = np.concatenate([[False], where, [False]]).astype(np.int8)
    change = np.diff(padded)
    return list(
        zip(
            np.flatnonzero(change == 1).tolist(),
            (np.flatnonzero(change == -1) - 1).tolist(),
            strict=True,
        )
    )
