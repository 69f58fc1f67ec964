"""Even times for filters that count frames.

A take's frame rate may change: two cameras, a recorder that slows down, frames that it dropped.
Filters along the frames then last longer in one part than in another, so signals of such a take are
resampled to even times, and what is found there belongs to its frames again.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze, frozen
from usdface.takes import frame_step

__all__ = ["EvenTimes", "even_times"]

# The rate is even where as many frames lie in each stretch of time [s], the longest blink, but for
# a share of them and for one: a dropped frame, or times rounded to milliseconds.
_STRETCH, _ALIKE = 0.6, 0.1
# Steps longer than this [s] are gaps, in which nothing is recorded: as long as lids take to close.
_GAP = 0.1
# The step of the even times is not exceeded in such a share of the time that was recorded: in a
# part with longer steps, interpolated noise is smaller than the filters take it to be.
_COVERED = 0.9
# Even times per frame at most: a take that consists of gaps keeps its own.
_MOST = 4.0


@dataclass(frozen=True, eq=False, slots=True)
class EvenTimes:
    """Even times over a take.

    Attributes
    ----------
    take : (F,) float64 [s]
        The take's own.
    times : (G,) float64 [s]
        Even; the take's own where its rate is even.
    step : float [s]
        Between two of them.
    """

    take: FloatArray
    times: FloatArray
    step: float

    def __post_init__(self) -> None:
        freeze(self, "take", "times")

    @property
    def own(self) -> bool:
        """Whether they are the take's own."""
        return self.times is self.take

    def resampled(self, values: FloatArray) -> FloatArray:
        """Return values of the take's frames (F, ...) at the even times (G, ...)."""
        return _at(self.times, self.take, values) if not self.own else values

    def of_frames(self, values: FloatArray) -> FloatArray:
        """Return values of the even times (G, ...) at the take's frames (F, ...)."""
        return _at(self.take, self.times, values) if not self.own else values

    def frames(self, places: IntArray) -> IntArray:
        """Return the frames of the take that are nearest to places among the even times: (N,)."""
        if self.own:
            return places
        wanted = self.times[places]
        after = np.searchsorted(self.take, wanted).clip(1, len(self.take) - 1)
        before = after - 1
        earlier = wanted - self.take[before] <= self.take[after] - wanted
        return np.where(earlier, before, after)


def even_times(times: FloatArray) -> EvenTimes:
    """Return even times over a take at `times` (F,) [s], its own where its rate is even."""
    take, median = frozen(times), frame_step(times)
    if len(take) < 3 or _even(take, median):
        return EvenTimes(take, take, median)
    steps = np.sort(np.diff(take))
    steps = steps[steps <= max(_GAP, median)]
    share = np.cumsum(steps) / steps.sum()
    step = float(steps[np.searchsorted(share, _COVERED)])
    count = int((take[-1] - take[0]) / step + 1e-6) + 1
    if count > _MOST * len(take):
        return EvenTimes(take, take, median)
    return EvenTimes(take, take[0] + step * np.arange(count), step)


def _even(times: FloatArray, step: float) -> bool:
    """Whether all stretches of time have as many frames as those with the median step have."""
    whole = np.flatnonzero(times + _STRETCH <= times[-1])
    frames = np.searchsorted(times, times[whole] + _STRETCH) - whole
    expected = _STRETCH / step
    return bool((np.abs(frames - expected) <= _ALIKE * expected + 1.0).all())


def _at(wanted: FloatArray, known: FloatArray, values: FloatArray) -> FloatArray:
    """Interpolate values (K, ...) of known times (K,) at wanted ones (N,): (N, ...)."""
    after = np.searchsorted(known, wanted).clip(1, len(known) - 1)
    before = after - 1
    share = ((wanted - known[before]) / (known[after] - known[before])).clip(0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    # Where both are infinite so is the value between them.
    same = values[before] == values[after]
    with np.errstate(invalid="ignore"):
        between = (1.0 - share) * values[before] + share * values[after]
    return np.asarray(np.where(same, values[before], between))
