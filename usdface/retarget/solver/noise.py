"""Noise of signals, by their third differences in time."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION, THIRD_DIFFERENCE
from usdface.takes import frame_step

__all__ = ["NEIGHBOURS", "independent_lags", "typical_deviation", "white_noise"]

# The lag of neighbouring frames, and the number of larger lags at which differences are taken: of
# more the mean is the same.
NEIGHBOURS, _LAGS = 1, 4
# Most recordings are filtered or interpolated, so that neighbouring frames have the same error.
# Errors so far apart [s] are nearly independent after filters of 4 Hz and above. Of the spans the
# one with the least noise, as motion that the rig does not explain grows with the span. Chosen of
# 0.07, 0.1, 0.13 and 0.2 s alone and spans of them, on performers 1 to 4 of python -m
# benchmarks.performers, 10 s, filtered at 4 to 12 Hz or interpolated.
_INDEPENDENT = (0.1, 0.2)


def white_noise(values: FloatArray) -> float:
    """Estimate the white noise of some signals.

    Third differences in time keep the noise (their variance is 20 times the noise's) and
    drop the slow misfit of rig and performer. The median makes it robust to spikes.

    Parameters
    ----------
    values : (F, N) float64
        NaN where there is none.

    Returns
    -------
    float
        Standard deviation; 0 if nowhere four frames follow each other.
    """
    return typical_deviation(np.diff(values, 3, axis=0)) if len(values) >= 4 else 0.0


def independent_lags(times: FloatArray) -> tuple[int, ...]:
    """Return the lags, in frames at `times` (F,) [s], at which errors are independent.

    Also where a filter or interpolation made neighbouring frames alike.
    """
    step = frame_step(times)
    if step <= 0.0:
        return (NEIGHBOURS,)
    least, most = (max(round(span / step), 1) for span in _INDEPENDENT)
    return tuple(np.unique(np.linspace(least, most, _LAGS).round().astype(int)).tolist())


def typical_deviation(differences: FloatArray) -> float:
    """Return the standard deviation of white noise by its third differences (of any shape).

    By the median of those that are not NaN; 0 if all are.
    """
    known = differences[~np.isnan(differences)]
    if not known.size:
        return 0.0
    return float(np.median(np.abs(known)) * MEDIAN_TO_DEVIATION / np.sqrt(THIRD_DIFFERENCE))
