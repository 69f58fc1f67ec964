"""A take without knowing its markers: the still face, its resting frames and its peaks."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial.distance import cdist

from usdface.retarget.align import rigid_fit
from usdface.takes import FloatArray, IntArray, visible

__all__ = ["Performance", "peak_frames", "rest_frames", "resting_poses", "still_face"]

# More frames than these say nothing new of a face.
_MOST_FRAMES = 2000
_MODES = 8
_ROUNDS = 4
# Frames this near to each other, as a share of the spread of the motion, are the same pose.
_SAME_POSE = 0.15
# What counts as resting is no longer than this [s].
_LONGEST_REST = 0.5
# A resting face is slow this long [s] before and after.
_STILL = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Performance:
    """A take with the head held still, in few numbers.

    Attributes
    ----------
    still : (F, M, 3) float64 [m]
        Markers without the head's motion, as far as the calmest of them tell it.
    scores : (F, K) float64 [m]
        The strongest modes of the motion.
    """

    still: FloatArray
    scores: FloatArray


def still_face(positions: FloatArray) -> Performance:
    """Hold the head still by the calmer half of the markers.

    Parameters
    ----------
    positions : (F, M, 3) float64
        NaN where occluded; each marker is seen at least once.
    """
    seen = visible(positions)
    still = positions
    fullest = int(seen.sum(axis=1).argmax())
    middle = np.where(seen[fullest, :, None], positions[fullest], np.nan)
    calm = np.ones(positions.shape[1], dtype=bool)
    for _ in range(_ROUNDS):
        pose, _ = rigid_fit(np.where(calm[:, None], middle, np.nan), positions)
        still = pose.to_head(positions)
        middle = np.nanmedian(still, axis=0)
        restless = np.sqrt(np.nanmean(((still - middle) ** 2).sum(axis=2), axis=0))
        calm = restless <= np.median(restless)
        calm |= np.argsort(np.argsort(restless)) < 4
    away = np.where(seen[..., None], still - middle, 0.0).reshape(len(still), -1)
    some = away[:: max(1, len(away) // _MOST_FRAMES)]
    _, _, modes = np.linalg.svd(some - some.mean(axis=0), full_matrices=False)
    scores = (away - some.mean(axis=0)) @ modes[:_MODES].T
    # A swapped or mislabelled marker jumps for a frame or two.
    return Performance(still, median_filter(scores, size=(min(5, len(scores)), 1)))


def rest_frames(performance: Performance, times: FloatArray) -> tuple[int, int]:
    """Return the first and last frame index of the pose that the face comes back to and holds."""
    return resting_poses(performance, times, 1)[0]


def resting_poses(performance: Performance, times: FloatArray, count: int) -> list[tuple[int, int]]:
    """Return the frames of up to `count` different poses that are held, the most usual first."""
    scores = performance.scores
    step = max(1, len(scores) // _MOST_FRAMES)
    some = scores[::step]
    spread = float(np.sqrt(((some - some.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if spread == 0.0 or len(scores) == 1:
        return [(0, len(scores) - 1)]
    size = _SAME_POSE * spread
    apart = cdist(some, some, "sqeuclidean")
    usual = np.exp(-apart / (2 * size**2)).mean(axis=1)
    speed = np.linalg.norm(np.gradient(scores, times, axis=0), axis=1)
    # A turning point is slow for a moment, a resting face for longer.
    around = round(2 * _STILL / max(float(np.median(np.diff(times))), 1e-9)) + 1
    speed = maximum_filter1d(speed, min(around, len(speed)))[::step]
    restful = usual / (1.0 + (speed / max(float(np.median(speed)), 1e-12)) ** 2)
    found: list[tuple[int, int]] = []
    while len(found) < count and restful.max() > 0.0:
        best = int(restful.argmax())
        found.append(_held(scores, times, step * best, size))
        restful[apart[best] < (2 * size) ** 2] = 0.0
    return found


def _held(scores: FloatArray, times: FloatArray, best: int, size: float) -> tuple[int, int]:
    """Return the frames around `best` that stay within `size` of it."""
    near = np.linalg.norm(scores - scores[best], axis=1) < size
    near &= np.abs(times - times[best]) <= 0.5 * _LONGEST_REST
    breaks = np.flatnonzero(~near)
    before, after = breaks[breaks < best], breaks[breaks > best]
    first = int(before[-1]) + 1 if len(before) else 0
    last = int(after[0]) - 1 if len(after) else len(scores) - 1
    return first, last


def peak_frames(performance: Performance, rest: tuple[int, int], count: int) -> IntArray:
    """Return the frame indices of expressions far from rest and from each other, most first."""
    scores = performance.scores
    step = max(1, len(scores) // _MOST_FRAMES)
    some = scores[::step]
    neutral = scores[rest[0] : rest[1] + 1].mean(axis=0)
    far = np.linalg.norm(some - neutral, axis=1)
    least = 0.02 * float(far.max(initial=0.0))
    peaks: list[int] = []
    while len(peaks) < min(count, len(some)) and far.max() > least:
        peaks.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(some - some[peaks[-1]], axis=1))
    return step * np.array(peaks, dtype=np.int64)
