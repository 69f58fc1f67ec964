"""Events: stretches of a take in which an emotion is shown, and how far it is held in each frame.

A correction that follows the output frame by frame jumps wherever the output does. So an event is
corrected as a whole: a pose that is held gets a constant correction. Nor do the ends of an event
depend on a threshold at one frame: two frames belong together in so far as the output does not fall
between them, so everything here is a continuous function of the output.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from usdface.arrays import FloatArray, IntArray
from usdface.smooth_step import smooth_step

__all__ = ["Events", "events_of", "frame_events"]

# Shares of the onset at which an event is over (a Schmitt trigger: O. Schmitt, "A thermionic
# trigger", 1938), and of the size of an event from which it counts as held, tuned by
# benchmarks/expression_takes.py.
_RELEASE = 0.5
_HELD = 0.62
# Ups and downs of less than this share of the size are noise: the envelope rises monotonically.
_PLAY = 0.06
# A frame is of the peak of an event from the second share of its size on, not up to the first.
_PEAK = (0.8, 0.9)
# Frames at a time; a limit of memory.
_BLOCK = 256


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """The frames of a take in which an emotion is shown.

    Attributes
    ----------
    frames : (N,) int64
    size : (N,) float64
        The largest output of the event.
    envelope : (N,) float64
        0 at either end, 1 where it is held; rises and falls as the output does.
    peaks : function
        From values (F, T) over the take to their means (N, T) at the peak of each frame's event.
    """

    frames: IntArray
    size: FloatArray
    envelope: FloatArray
    peaks: Callable[[FloatArray], FloatArray]


def events_of(output: FloatArray, onset: float) -> Events:
    """Return the events of a curve (F,).

    They reach the onset, and last as long as the curve is above half of it.
    """
    release = _RELEASE * onset
    shown = np.concatenate([[False], output > release, [False]])
    ends = np.flatnonzero(np.diff(shown.astype(np.int8))).reshape(-1, 2)
    runs = [np.arange(first, end) for first, end in ends.tolist()]
    runs = [at for at in runs if output[at].max() > onset]
    stretches = [_Stretch(at, output[at], onset, release) for at in runs]
    if not stretches:
        return frame_events(np.zeros(0), onset)

    def peaks(values: FloatArray) -> FloatArray:
        return np.concatenate([stretch.peaks(values) for stretch in stretches])

    return Events(
        np.concatenate(runs),
        np.concatenate([stretch.size for stretch in stretches]),
        np.concatenate([stretch.envelope() for stretch in stretches]),
        peaks,
    )


def frame_events(output: FloatArray, onset: float) -> Events:
    """Return each frame of a curve (F,) above the onset as an event of its own."""
    frames = np.flatnonzero(output > onset)
    return Events(frames, output[frames], np.ones(len(frames)), lambda values: values[frames])


class _Stretch:
    """The output of consecutive frames (N,) above the release, which reaches the onset.

    Frames above the onset without one below it between them are a core. Two frames belong together
    by ``1 - u (o - d) / (o - release)``, with d the least output between them, o the smaller of
    their own, the onset at most, and u how far d is from the onset to the release, 0 to 1.
    """

    def __init__(self, at: IntArray, own: FloatArray, onset: float, release: float) -> None:
        self._at, self._own, self._onset, self._release = at, own, onset, release
        self._core = label(own >= onset)[0] - 1  # -1 between the cores
        self._tops = np.array([own[self._core == k].max() for k in range(self._core.max() + 1)])
        self._least = self._least_between()
        self.size = np.empty(len(own))
        for rows, together in self._together():
            self.size[rows] = (together * self._tops).max(axis=1)

    def envelope(self) -> FloatArray:
        """Return the envelope (N,)."""
        held = np.maximum(_HELD * self.size, self._release + 1e-9)
        settled = _settled(self._own, self._release, _PLAY * self.size)
        return smooth_step((settled - self._release) / (held - self._release))

    def peaks(self, values: FloatArray) -> FloatArray:
        """Return the mean (N, T) of values (F, T) at the peak of each frame's event."""
        inner = self._core >= 0
        output, core, values = self._own[inner], self._core[inner], values[self._at[inner]]
        means = np.empty((len(self._own), values.shape[1]))
        for rows, together in self._together():
            size = self.size[rows[: len(together)], None]
            share = (output / size - _PEAK[0]) / (_PEAK[1] - _PEAK[0])
            weights = np.clip(share, 0.0, 1.0) * together[:, core]
            means[rows] = weights @ values / weights.sum(axis=1, keepdims=True)
        return means

    def _together(self) -> Iterator[tuple[IntArray, FloatArray]]:
        """Yield frames (B,) and how far they belong to each core: (B, K), (1, K) for a core's own.

        The frames of a core belong to the others alike, and have one size.
        """
        frames = np.flatnonzero(self._core < 0)
        for block in np.split(frames, range(_BLOCK, len(frames), _BLOCK)):
            yield block, self._belonging(self._own[block], self._least[block])
        for k in range(len(self._tops)):
            rows = np.flatnonzero(self._core == k)
            one = self._belonging(np.array([self._onset]), self._least[rows[:1]])
            yield rows, one

    def _belonging(self, own: FloatArray, least: FloatArray) -> FloatArray:
        fallen = np.clip((self._onset - least) / (self._onset - self._release), 0.0, 1.0)
        own = own[:, None]
        share = np.maximum(own - least, 0.0) / np.maximum(own - self._release, 1e-12)
        return np.asarray(1.0 - fallen * np.minimum(share, 1.0))

    def _least_between(self) -> FloatArray:
        """Return the least output from each frame to each core, both included: (N, K)."""
        least = np.empty((len(self._own), len(self._tops)))
        for k in range(len(self._tops)):
            first, last = np.flatnonzero(self._core == k)[[0, -1]]
            least[first : last + 1, k] = self._onset
            least[: first + 1, k] = np.minimum.accumulate(self._own[first::-1])[::-1]
            least[last:, k] = np.minimum.accumulate(self._own[last:])
        return least


def _settled(curve: FloatArray, start: float, play: FloatArray) -> FloatArray:
    """Return a curve (N,) from `start` on without ups and downs of less than twice `play` (N,).

    Hysteresis: the lower of a forward and a backward pass, so that either end is later by `play`
    and none begins with a step.
    """
    passes = []
    for course, free in ((curve, play), (curve[::-1], play[::-1])):
        at, settled = start, np.empty(len(course))
        for k, (value, reach) in enumerate(zip(course.tolist(), free.tolist(), strict=True)):
            at = min(max(at, value - reach), value + reach)
            settled[k] = at
        passes.append(settled)
    return np.minimum(passes[0], passes[1][::-1])
