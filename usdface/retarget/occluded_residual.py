"""The residual of a marker, interpolated over the frames in which it is occluded.

A performer's face is not the character's: a marker's residual is large and lasts. If it ended where
the marker is occluded, the weights would jump there, as far as it had drawn them.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.takes import frame_step

__all__ = ["occluded_residual"]

# Time [s] in which the autocorrelation of a marker's residual falls by the factor e. Set by
# hand; gaps of 0.1 to 4 s in AnimFace's Jaw are as good with 3 s, at 0.3 s an open jaw sinks by a
# tenth.
_LASTS = 1.0
# Time [s] over which noise is averaged at either end. Set by hand.
_STEADY = 0.2


def occluded_residual(
    residual: FloatArray, occluded: BoolArray, times: FloatArray, *, noise: float, misfit: float
) -> FloatArray:
    """Return the expected residual of coordinates where they are occluded, 0 elsewhere.

    The mean of an Ornstein-Uhlenbeck process between its values at both ends of a gap; from one
    end alone it decays. As far as residuals are noise, their mean is taken.

    Parameters
    ----------
    residual : (F, N) float64 [m]
        Observed less predicted coordinates; any value where occluded.
    occluded : (F, N) bool
    times : (F,) float64 [s]
    noise, misfit : float [m]
        Standard deviations of a coordinate, by the markers and by the difference of the faces.

    Returns
    -------
    (F, N) float64 [m]
    """
    expected = np.zeros_like(residual)
    columns = np.flatnonzero(occluded.any(axis=0))
    seen = ~occluded[:, columns]
    own = np.where(seen, residual[:, columns], 0.0)
    frames = np.arange(len(times))[:, None]
    before = np.maximum.accumulate(np.where(seen, frames, -1), axis=0)
    after = np.minimum.accumulate(np.where(seen, frames, len(times))[::-1], axis=0)[::-1]
    since = np.where(before >= 0, times[:, None] - times[np.maximum(before, 0)], np.inf)
    last = len(times) - 1
    until = np.where(after <= last, times[np.minimum(after, last)] - times[:, None], np.inf)
    share = misfit**2 / max(misfit**2 + noise**2, 1e-300)
    count = max(1, round(_STEADY / frame_step(times))) if last else 1
    first = share * own + (1.0 - share) * _running_mean(own, seen, count)
    second = share * own + (1.0 - share) * _running_mean(own[::-1], seen[::-1], count)[::-1]
    from_first = _bridge(since, until) * np.take_along_axis(first, np.maximum(before, 0), axis=0)
    from_second = _bridge(until, since) * np.take_along_axis(
        second, np.minimum(after, last), axis=0
    )
    expected[:, columns] = np.where(seen, 0.0, from_first + from_second)
    return expected


def _running_mean(values: FloatArray, seen: BoolArray, count: int) -> FloatArray:
    """Return the mean of seen values (F, N) in the last `count` frames; others are 0."""
    sums, counts = np.cumsum(values, axis=0), np.cumsum(seen, axis=0)
    for each in (sums, counts):
        each[count:] -= each[:-count].copy()
    return np.asarray(sums / np.maximum(counts, 1))


def _bridge(since: FloatArray, until: FloatArray) -> FloatArray:
    """Return the share of the value `since` [s] ago, if the other end is `until` [s] ahead."""
    near, far = np.exp(-2.0 * until / _LASTS), np.exp(-2.0 * (since + until) / _LASTS)
    return np.exp(-since / _LASTS) * (1.0 - near) / np.maximum(1.0 - far, 1e-300)
