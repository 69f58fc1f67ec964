"""Neutral and peak frames of a take that is not bound yet: held poses and strong expressions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial.distance import cdist

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import POSE_MARKERS, rigid_fit
from usdface.takes import MarkerTake, frame_step, visible

__all__ = [
    "FEWEST_MARKERS",
    "MOST_PEAKS",
    "NEUTRALS",
    "HeldPose",
    "StabilisedTake",
    "check_frames",
    "distant_frames",
    "held_poses",
    "neutral_frames",
    "peak_frames",
    "shows_poses",
    "stabilised_markers",
    "stabilised_take",
    "without_head",
]

# A head pose takes three markers; the fourth lets one of them move with the face.
FEWEST_MARKERS = 4
# Peak frames that are looked for. As all numbers below without another source: set by hand; judge:
# `python benchmarks/binding.py`; docs/constants.md lists them.
MOST_PEAKS = 24
# Frames that are compared pairwise: bounds the memory (32 MB) and the time.
_MOST_FRAMES = 2000
# Modes of the motion.
_MODES = 8
# Rounds of choosing the calmer half of the markers.
_ROUNDS = 4
# Least number of markers for the head pose.
_FEWEST_CALM = 4
# Median filter of the modes [frames]: a swapped or mislabelled marker jumps for a frame or two.
_MEDIAN = 5
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
NEUTRALS, _APART, _USUAL, _BEGINNING, _BEGINS = 64, 0.6, 0.5, 0.3, 2.7
# The face is still at the beginning if slower than this share of its median speed.
_STILL_START = 0.5
# Least distance of a peak from neutral and other peaks, as a share of the farthest one's.
_LEAST_PEAK = 0.02


@dataclass(frozen=True, eq=False, slots=True)
class StabilisedTake:
    """Markers without head motion, and their motion in a few modes.

    Attributes
    ----------
    positions : (F, M, 3) float64 [m]
        Without head motion, by the calmer half of the markers; NaN where occluded.
    scores : (F, K) float64 [m]
        Of the strongest modes of the motion.
    """

    positions: FloatArray
    scores: FloatArray

    @property
    def sampled(self) -> IntArray:
        """Frames that show enough markers for a pose, at most `_MOST_FRAMES`, evenly spread."""
        frames = np.flatnonzero(self.shown)
        return frames[:: _step(len(frames))]

    @property
    def shown(self) -> BoolArray:
        """(F,) bool: frames with enough markers; the scores of others only look like a rest."""
        count = visible(self.positions).sum(axis=1)
        return np.asarray(count >= min(FEWEST_MARKERS, int(count.max())))


@dataclass(frozen=True, slots=True)
class HeldPose:
    """A pose that the face holds.

    Attributes
    ----------
    frames : (int, int)
        First and last frame index.
    usual : float
        Share of the take in it, frames counted by their likeness.
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


def shows_poses(take: MarkerTake) -> bool:
    """Return whether neutral frames can be found by the markers: in space, and enough at once."""
    return take.dimension == 3 and int(take.visible.sum(axis=1).max()) >= FEWEST_MARKERS


def neutral_frames(take: MarkerTake) -> tuple[int, int]:
    """Return the first and last frame index of the most likely neutral pose.

    Raises
    ------
    InputError
        If the take is two-dimensional, or has too few markers for the head pose.
    """
    return held_poses(without_head(take, "neutral"), take.times)[0].frames


def peak_frames(take: MarkerTake, neutral: tuple[int, int]) -> tuple[int, ...]:
    """Return the frame indices of expressions far from neutral and from each other, most first.

    Raises
    ------
    InputError
        As `neutral_frames`.
    """
    return tuple(distant_frames(without_head(take, "peak"), neutral, MOST_PEAKS).tolist())


def check_frames(take: MarkerTake, neutral: tuple[int, int] | None, peaks: Sequence[int]) -> None:
    """Check that the take has the neutral and peak frames.

    Raises
    ------
    InputError
        Naming the first that it does not have.
    """
    there = f"the take {take.source}, which has frames 0 to {len(take.times) - 1}"
    if neutral and neutral[1] >= len(take.times):
        raise InputError(
            f"neutral frames {neutral[0]} to {neutral[1]} lie outside {there}", "FRAMES_OUTSIDE"
        )
    if max(peaks, default=0) >= len(take.times):
        raise InputError(f"the peak frame {max(peaks)} lies outside {there}", "FRAMES_OUTSIDE")


def without_head(take: MarkerTake, kind: str) -> StabilisedTake:
    """Remove the head motion from the markers of a take in space that are ever seen.

    Raises
    ------
    InputError
        As `neutral_frames`; it names the `kind` of frames that are looked for.
    """
    if take.dimension != 3:
        raise InputError(
            f"the take {take.source} is of an image; its {kind} frames are found only where places "
            "are proposed, too (--propose). Name them, as in --neutral 0 30",
            "TAKE_KIND_WRONG",
        )
    used = np.flatnonzero(take.visible.any(axis=0))
    return stabilised_markers(take, used, f"{kind} frames cannot be found")


def stabilised_markers(take: MarkerTake, used: IntArray, otherwise: str) -> StabilisedTake:
    """Remove the head motion from the markers `used` (M,) of a take; each is seen at least once.

    Raises
    ------
    InputError
        If no frame shows enough of them for the head pose; it ends with `otherwise`.
    """
    if take.visible[:, used].sum(axis=1).max() < FEWEST_MARKERS:
        raise InputError(
            f"no frame of the take {take.source} shows {FEWEST_MARKERS} markers; {otherwise}",
            "MARKERS_TOO_FEW",
        )
    return stabilised_take(take.positions[:, used])


def stabilised_take(positions: FloatArray) -> StabilisedTake:
    """Remove the head motion, estimated from the calmer half of the markers.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        NaN where occluded; each marker is seen at least once, three in one frame.
    """
    seen = visible(positions)
    still = positions
    fullest = int(seen.sum(axis=1).argmax())
    middle = np.where(seen[fullest, :, None], positions[fullest], np.nan)
    calm = np.ones(positions.shape[1], dtype=bool)
    for _ in range(_ROUNDS):
        known = calm & visible(middle)
        if (seen & known).sum(axis=1).max() < POSE_MARKERS:  # the calm ones are never seen together
            break
        pose, _ = rigid_fit(np.where(known[:, None], middle, np.nan), positions)
        still = pose.to_head(positions)
        middle = np.nanmedian(still, axis=0)
        restless = np.sqrt(np.nanmean(((still - middle) ** 2).sum(axis=2), axis=0))
        calm = restless <= np.median(restless)
        calm |= np.argsort(np.argsort(restless)) < _FEWEST_CALM
    away = np.where(seen[..., None], still - middle, 0.0).reshape(len(still), -1)
    some = away[:: _step(len(away))]
    _, _, modes = np.linalg.svd(some - some.mean(axis=0), full_matrices=False)
    scores = (away - some.mean(axis=0)) @ modes[:_MODES].T
    return StabilisedTake(still, median_filter(scores, size=(min(_MEDIAN, len(scores)), 1)))


def _step(count: int) -> int:
    """Return the step that leaves at most `_MOST_FRAMES` of `count` frames."""
    return max(1, -(-count // _MOST_FRAMES))


def held_poses(
    stabilised: StabilisedTake, times: FloatArray, count: int = NEUTRALS
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
    alike = np.exp(-apart / (2 * size**2))
    usual = alike.mean(axis=1)
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
        first = float(alike[best, begins].mean())
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
    some = there[:: _step(len(there))]
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
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2] - 1
    held = np.minimum(times[last] - times[first], _LONGEST_HOLD)
    own = (first <= best) & (best <= last)
    run = int(np.lexsort((~own, -held))[0])
    middle = times[best] if own[run] else (times[first[run]] + times[last[run]]) / 2.0
    reach = 0.5 * _LONGEST_HOLD
    frames = np.flatnonzero(np.abs(times - middle) <= reach)
    return max(int(frames[0]), int(first[run])), min(int(frames[-1]), int(last[run]))


def distant_frames(stabilised: StabilisedTake, neutral: tuple[int, int], count: int) -> IntArray:
    """Return up to `count` frame indices far from neutral and from each other, most first."""
    scores, frames = stabilised.scores, stabilised.sampled
    some = scores[frames]
    mean = scores[neutral[0] : neutral[1] + 1].mean(axis=0)
    far = np.linalg.norm(some - mean, axis=1)
    least = _LEAST_PEAK * float(far.max(initial=0.0))
    peaks: list[int] = []
    while len(peaks) < min(count, len(some)) and far.max() > least:
        peaks.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(some - some[peaks[-1]], axis=1))
    return frames[np.array(peaks, dtype=np.int64)]
