"""Local maxima of a curve."""

import numpy as np

from usdface.arrays import FloatArray, IntArray

__all__ = ["highest", "local_maxima"]


def local_maxima(curve: FloatArray, least: float, apart: int = 1) -> IntArray:
    """Return the local maxima of a curve, in order.

    The same as ``scipy.signal.find_peaks(curve, height=least, distance=apart)``, whose import costs
    more than the whole closure of eyes.

    Parameters
    ----------
    curve : (F,) float64
        The ends are no maxima; of a flat top the middle is one.
    least : float
        Lower ones are left out.
    apart : int
        Of two closer than this, the lower one is left out, starting with the highest.
    """
    change = np.flatnonzero(np.diff(curve))
    # Runs of equal values lie between two changes.
    rises = curve[change] < curve[change + 1] if len(change) else np.zeros(0, dtype=bool)
    top = np.flatnonzero(rises[:-1] & ~rises[1:])
    peaks = (change[top] + 1 + change[top + 1]) // 2
    peaks = peaks[curve[peaks] >= least]
    kept = np.ones(len(peaks), dtype=bool)
    for place in np.argsort(curve[peaks], kind="stable")[::-1]:
        if kept[place]:
            near = np.abs(peaks - peaks[place]) < apart
            near[place] = False
            kept[near] = False
    return np.asarray(peaks[kept])


def highest(curve: FloatArray) -> int:
    """Return where a curve (F,) is highest: of a flat top the middle, of several tops the first."""
    padded = np.pad(curve, 1, constant_values=-np.inf)
    return int(local_maxima(padded, float(curve.max()))[0]) - 1
