"""Poses that a face holds in a take: candidates for the neutral."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial.distance import cdist

from usdface.arrays import BoolArray, FloatArray
from usdface.binding.stabilised_take import StabilisedTake, sample_step
from usdface.geometry.marker_spread import rms_radius
from usdface.numerics.frame_ranges import frame_ranges
from usdface.takes import frame_step, visible

__all__ = ["HeldPose", "held_poses"]

# Frames this near to each other, as a share of the spread of the motion, are the same pose.
_SAME_POSE = 0.15
# The neutral pose is held no longer than this [s].
_LONGEST_HOLD = 0.5
# A marker is not part of a held pose where it is this many times as far from its median place as in
# most of its frames, of three; at least this share of the face's size counts. Of noise no sample in
# ten million is 4 times as far (3D, 6.2 deviations), a blink of AnimFace's lid markers 8 to 13.
_ELSEWHERE, _LEAST_AWAY = 4.0, 0.002
_SPIKE = 3  # median filter [frames]: a single one may be a wrong label
# A face that holds a pose is slow this long [s] before and after, a turning point for a moment; a
# neutral of that length is half as likely as a long one.
_STILL = 0.1
# Number of held poses that are candidates for the neutral, and how far apart they are at least, in
# sizes of a pose; exponent of their share of the take; duration [s] and factor of poses that the
# take begins with. Judge: `python benchmarks/neutral.py`.
_NEUTRALS, _APART, _USUAL, _BEGINNING, _BEGINS = 64, 0.6, 0.5, 0.3, 2.7
# The face is still at the beginning if slower than this share of its median speed.
_STILL_START = 0.5


@dataclass(frozen=True, slots=True)
class HeldPose:
    """A pose that the face holds.

    Attributes
    ----------
    frames : (int, int)
        First and last frame index.
    usual : float
        Share of the take in it, frames weighted by their similarity.
    first : float
        The same of the beginning of the take.
    lasts : float [s]
    """

    frames: tuple[int, int]
    usual: float
    first: float
    lasts: float

    @property
    def likely(self) -> float:
        """Likelihood that it is the neutral, by the markers alone: any unit."""
        lasting = self.lasts / (self.lasts + _STILL)
        return float(self.usual**_USUAL * _BEGINS**self.first * lasting)


def held_poses(
    stabilised: StabilisedTake, times: FloatArray, count: int = _NEUTRALS
) -> list[HeldPose]:
    """Return up to `count` different poses that are held most, the likeliest neutral first.

    Parameters
    ----------
    stabilised : StabilisedTake
    times : (F,) float64 [s]
    count : int
    """
    scores, shown, frames = stabilised.scores, stabilised.shown, stabilised.sampled
    some = scores[frames]
    spread = rms_radius(some)
    if spread == 0.0 or len(scores) == 1:
        return [HeldPose((0, len(scores) - 1), 1.0, 1.0, 1.0)]
    size = _SAME_POSE * spread
    apart = cdist(some, some, "sqeuclidean")
    similarity = np.exp(-apart / (2 * size**2))
    usual = similarity.mean(axis=1)
    begins = times[frames] <= times[frames[0]] + _BEGINNING
    speed = np.linalg.norm(np.gradient(scores, times, axis=0), axis=1)
    around = round(2 * _STILL / max(frame_step(times), 1e-9)) + 1
    speed = maximum_filter1d(speed, min(around, len(speed)))[frames]
    slow = max(float(np.median(speed)), 1e-12)
    held = usual / (1.0 + (speed / slow) ** 2)
    found: list[HeldPose] = []
    # The beginning first, where the face is still: most takes begin at rest.
    start = np.where(begins & (speed < _STILL_START * slow), held, 0.0)
    best = int((start if start.any() else held).argmax())
    while len(found) < count and held.max() > 0.0:
        near = shown & (np.linalg.norm(scores - some[best], axis=1) < size)
        hold = _hold(_calm(stabilised.positions, near), times, int(frames[best]))
        lasts = (hold[1] - hold[0] + 1) * max(frame_step(times), 1e-9)
        first = float(similarity[best, begins].mean())
        found.append(HeldPose(hold, float(usual[best]), first, lasts))
        held[apart[best] < (_APART * size) ** 2] = 0.0
        best = int(held.argmax())
    return sorted(found, key=lambda pose: -pose.likely)


def _calm(positions: FloatArray, near: BoolArray) -> BoolArray:
    """Return the frames `near` a pose (F,) in which no marker is elsewhere than in most of them.

    A blink moves two markers of many: the modes of the whole motion stay near the pose. All frames
    if there is a marker elsewhere in each.
    """
    frames = np.flatnonzero(near)
    there = positions[frames]
    some = there[:: sample_step(len(there))]
    seen = visible(some).any(axis=0)
    there, middle = there[:, seen], np.nanmedian(some[:, seen], axis=0)
    away = np.linalg.norm(there - middle, axis=2)
    away /= np.nanmedian(away, axis=0).clip(min=_LEAST_AWAY * rms_radius(middle))
    away = median_filter(np.nan_to_num(away), size=(_SPIKE, 1))
    calm = np.zeros(len(near), dtype=bool)
    calm[frames] = away.max(axis=1) <= _ELSEWHERE
    return calm if calm.any() else near


def _hold(near: BoolArray, times: FloatArray, best: int) -> tuple[int, int]:
    """Return the frames `near` a pose (F,) for as long as a neutral is held, around `best` if so.

    Else those of the longest time that is spent there.
    """
    first, last = np.array(frame_ranges(near)).T
    held = np.minimum(times[last] - times[first], _LONGEST_HOLD)
    own = (first <= best) & (best <= last)
    run = int(np.lexsort((~own, -held))[0])
    middle = times[best] if own[run] else (times[first[run]] + times[last[run]]) / 2.0
    reach = 0.5 * _LONGEST_HOLD
    frames = np.flatnonzero(np.abs(times - middle) <= reach)
    return max(int(frames[0]), int(first[run])), min(int(frames[-1]), int(last[run]))
