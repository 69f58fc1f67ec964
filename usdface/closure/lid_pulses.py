"""Pulses of a lid: the white top-hat of how far it is closed, smoothed in proportion to noise."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, grey_opening

from usdface.arrays import FloatArray
from usdface.cleanup.blink_motion import LONGEST_BLINK
from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION, THIRD_DIFFERENCE

__all__ = ["APART", "LEAST_HEIGHT", "crossing_time", "lid_pulses"]

# Standard deviation [s] of the smoothing: a third of the fastest closing; of noisy markers half the
# width of a blink.
_SMOOTHING = (0.02, 0.05)
# Least height of a pulse in deviations of the smoothed noise, of which the opening alone takes two.
_ABOVE_NOISE = 6.0
# Two pulses closer than this [s] are one, and those of two eyes belong together.
APART = 0.12
# Least height of an eye's blinks, in closed eyes of the character. Those of two real takes: 0.44 to
# 1.15.
LEAST_HEIGHT = 0.15


def lid_pulses(closing: FloatArray, step: float) -> tuple[FloatArray, FloatArray, float]:
    """Return the smoothed curve of an eye (F,), its pulses (F,), and the least height above noise.

    Parameters
    ----------
    closing : (F,) float64
        How far the eye is closed.
    step : float [s]
        Between two frames.
    """
    smooth, floor = _smoothed(closing, step)
    width = max(round(LONGEST_BLINK / step), 3)
    return smooth, smooth - grey_opening(smooth, width, mode="nearest"), floor


def crossing_time(times: FloatArray, share: FloatArray, peak: int, way: int, level: float) -> float:
    """Return the time at which a pulse passes a level, going away from its peak: [s].

    Parameters
    ----------
    times : (F,) float64 [s]
    share : (F,) float64
        The pulse, by its height.
    peak : int
        Frame index.
    way : {-1, 1}
        Into the past or the future.
    level : float
    """
    side = share[peak:] if way > 0 else share[peak::-1]
    at = times[peak:] if way > 0 else times[peak::-1]
    below = np.flatnonzero(side < level)
    if not len(below):
        return float(at[-1])
    k = int(below[0])
    high, low = side[k - 1], side[k]
    return float(at[k - 1] + (at[k] - at[k - 1]) * (high - level) / max(high - low, 1e-12))


def _smoothed(closing: FloatArray, step: float) -> tuple[FloatArray, float]:
    """Return the smoothed curve of an eye, and the least height of a pulse above noise."""
    # By the median, as blinks are rare.
    steps = np.abs(np.diff(closing, 3))
    usual = float(np.median(steps)) if len(steps) else 0.0
    noise = MEDIAN_TO_DEVIATION * usual / np.sqrt(THIRD_DIFFERENCE)
    smooth, floor = closing, _ABOVE_NOISE * noise
    for width in _SMOOTHING:
        sigma = width / step
        smooth = gaussian_filter1d(closing, sigma, mode="nearest")
        floor = _ABOVE_NOISE * noise / max(np.sqrt(2.0 * np.sqrt(np.pi) * sigma), 1.0)
        if floor < LEAST_HEIGHT:
            break
    return smooth, floor
