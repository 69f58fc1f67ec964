"""Events: stretches of a take with an emotion, and how far it is held in each frame.

A correction that follows the output frame by frame jumps wherever the output does. So an event is
corrected as a whole: a pose that is held gets a constant correction. Nor do the ends of an event
depend on a threshold at one frame: two frames belong together in so far as the output does not fall
between them, so everything here is a continuous function of the output.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import label

from usdface.arrays import FloatArray, IntArray
from usdface.numerics.frame_blocks import frame_blocks
from usdface.numerics.frame_ranges import frame_ranges
from usdface.numerics.ramps import linear_ramp, smooth_step

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
# Time below the onset [s] that lies between a frame and a core, beyond that to the nearest core, at
# which the core begins to count less and counts no more. A limit of computing time: without it each
# frame is compared with all cores of a stretch that lasts. Emotions that come and go in less than
# half a minute do not depend on it.
_FADE = (30.0, 60.0)
# Frames of a core within this time [s] count as one, with their mean, in averages over a
# peak: a faster take than of 120 Hz would take time by the square of its rate.
_LEAST_STEP = 1.0 / 120.0
# Places and frames of cores at a time; limits of memory (1 MB) that no result depends on.
_BLOCK = 64
_COLUMNS = 2048


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """The frames of a take in which an emotion is detected.

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


def events_of(output: FloatArray, onset: float, step: float) -> Events:
    """Return the events of a curve (F,), with `step` [s] between its frames.

    They reach the onset, and last as long as the curve is above half of it.
    """
    release = _RELEASE * onset
    runs = [np.arange(first, last + 1) for first, last in frame_ranges(output > release)]
    runs = [at for at in runs if output[at].max() > onset]
    stretches = [_Stretch(at, output[at], (release, onset), step) for at in runs]
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
    their own, the onset at most, and u how far d is from the onset to the release, 0 to 1. Cores
    far behind the nearest one fade out (`_FADE`).

    The frames of a core belong to the others alike, and have one size: it is one place. Each other
    frame is a place of its own.
    """

    def __init__(
        self, at: IntArray, own: FloatArray, levels: tuple[float, float], step: float
    ) -> None:
        self._at, self._own = at, own
        self._release, self._onset = levels
        onset = self._onset
        step = step or _LEAST_STEP  # a single frame has none
        # In frames.
        self._fade = np.array(_FADE) / step
        self._joined = max(1, int(_LEAST_STEP / step + 1e-6))
        core = label(own >= onset)[0] - 1  # -1 between the cores
        inner = core >= 0
        first = ~inner | (core != np.concatenate([[-1], core[:-1]]))
        self._place = np.cumsum(first) - 1
        self._inner, self._core = np.flatnonzero(inner), core[inner]
        self._level = np.minimum(own[first], onset)
        self._cores = np.flatnonzero(inner[first])
        starts = np.searchsorted(self._core, np.arange(len(self._cores)))
        self._tops = np.maximum.reduceat(own[inner], starts)
        # The least output between a core and the next.
        self._dips = np.minimum.reduceat(self._level, self._cores)[:-1]
        self._left, self._right = _runs_of_least(self._level, self._cores)
        # Frames below the onset before each place; those of the place itself count by half.
        below = np.ones(len(self._level))
        below[self._cores] = 0.0
        self._count = np.cumsum(below) - below / 2
        sizes = np.empty(len(self._level))
        for places, cores, together in self._together():
            sizes[places] = (together * self._tops[cores]).max(axis=1)
        self._sizes = sizes
        self.size = sizes[self._place]

    def envelope(self) -> FloatArray:
        """Return the envelope (N,)."""
        held = np.maximum(_HELD * self.size, self._release + 1e-9)
        settled = _settled(self._own, self._release, _PLAY * self.size)
        return smooth_step((settled - self._release) / (held - self._release))

    def peaks(self, values: FloatArray) -> FloatArray:
        """Return the mean (N, T) of values (F, T) at the peak of each frame's event."""
        output, values, core, count = self._joined_frames(values[self._at[self._inner]])
        means = np.empty((len(self._level), values.shape[1]))
        for places, cores, together in self._together():
            size = self._sizes[places, None]
            total, mean = np.zeros((len(size), 1)), np.zeros((len(size), values.shape[1]))
            first, end = np.searchsorted(core, [cores.start, cores.stop])
            for part in frame_blocks(end - first, _COLUMNS):
                columns = slice(first + part.start, first + part.stop)
                weights = linear_ramp(output[columns] / size, *_PEAK)
                weights *= together[:, core[columns] - cores.start] * count[columns]
                total += weights.sum(axis=1, keepdims=True)
                mean += weights @ values[columns]
            means[places] = mean / total
        return np.asarray(means[self._place])

    def _joined_frames(
        self, values: FloatArray
    ) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Return means of frames of the cores: output (J,), values (J, T), core, how many (J,).

        The output is of the peak where that of one of the frames is, however short: no event is
        without a peak.
        """
        output, core = self._own[self._inner], self._core
        if self._joined == 1:
            return output, values, core, np.ones(len(output))
        within = np.arange(len(core)) - np.searchsorted(core, core)
        starts = np.flatnonzero(within % self._joined == 0)
        count = np.diff(np.append(starts, len(core))).astype(np.float64)
        most = np.maximum.reduceat(output, starts)
        output = np.maximum(np.add.reduceat(output, starts) / count, _PEAK[1] * most)
        values = np.add.reduceat(values, starts, axis=0) / count[:, None]
        return output, values, core[starts], count

    def _together(self) -> Iterator[tuple[slice, slice, FloatArray]]:
        """Yield places, the cores near them, and how far they belong to each: (B, K)."""
        counts = self._count[self._cores]
        for places in frame_blocks(len(self._level), _BLOCK):
            own = self._count[places]
            after = np.searchsorted(self._cores, np.arange(places.start, places.stop))
            # Those beyond the first and the last core have none on that side.
            beside = np.abs(counts[np.clip([after - 1, after], 0, len(counts) - 1)] - own)
            nearest = beside.min(axis=0)
            reach = nearest + self._fade[1]
            near = [(own - reach).min(), (own + reach).max()]
            cores = slice(
                int(np.searchsorted(counts, near[0], side="left")),
                int(np.searchsorted(counts, near[1], side="right")),
            )
            far = np.abs(counts[cores] - own[:, None]) - nearest[:, None]
            together = self._belonging(self._level[places], self._least(places, after, cores))
            together *= 1.0 - smooth_step((far - self._fade[0]) / np.diff(self._fade))
            yield places, cores, together

    def _belonging(self, own: FloatArray, least: FloatArray) -> FloatArray:
        fallen = linear_ramp(least, self._onset, self._release)
        own = own[:, None]
        share = np.maximum(own - least, 0.0) / np.maximum(own - self._release, 1e-12)
        return np.asarray(1.0 - fallen * np.minimum(share, 1.0))

    def _least(self, places: slice, after: IntArray, cores: slice) -> FloatArray:
        """Return the least output from some places to some cores, both included: (B, K).

        Parameters
        ----------
        places : slice
        after : (B,) int64
            The first core that is not before each place.
        cores : slice
        """
        k, after = np.arange(cores.start, cores.stop), after[:, None]
        dips = np.concatenate([[np.inf], self._dips, [np.inf]])
        left, right = self._left[places, None], self._right[places, None]
        # Added by each core to the way from the place to it: the dip before it.
        rightward = np.where(k > after, dips[k], np.where(k == after, right, np.inf))
        leftward = np.where(k < after - 1, dips[k + 1], np.where(k == after - 1, left, np.inf))
        rightward = np.minimum.accumulate(rightward, axis=1)
        leftward = np.minimum.accumulate(leftward[:, ::-1], axis=1)[:, ::-1]
        return np.where(k >= after, rightward, leftward)


def _runs_of_least(level: FloatArray, cores: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the least level (P,) from the core before each place, and to the one from it on."""
    left, right = np.empty(len(level)), np.empty(len(level))
    ends = [0, *cores.tolist(), len(level)]
    for first, end in pairwise(ends):
        # A core ends one run and begins the next; on its left is the dip before it.
        stop = min(end + 1, len(level))
        left[first + 1 : stop] = np.minimum.accumulate(level[first:stop])[1:]
        right[first + 1 : stop] = np.minimum.accumulate(level[first:stop][::-1])[::-1][1:]
    first, last = cores[0], cores[-1]
    left[0] = level[0]
    right[: first + 1] = np.minimum.accumulate(level[: first + 1][::-1])[::-1]
    right[last + 1 :] = np.inf
    return left, right


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
