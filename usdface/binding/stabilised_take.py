"""Markers of a take without head motion, before any of them is bound, and their strongest modes."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.geometry.rigid_fit import POSE_MARKERS, rigid_fit
from usdface.takes import MarkerTake, visible

__all__ = [
    "FEWEST_MARKERS",
    "StabilisedTake",
    "sample_step",
    "stabilised_markers",
    "stabilised_take",
    "without_head",
]

# A head pose takes three markers; the fourth lets one of them move with the face.
FEWEST_MARKERS = 4
# Frames that are compared pairwise: bounds the memory (32 MB) and the time. As all numbers below:
# set by hand; judge: `python benchmarks/binding.py`; docs/constants.md lists them.
_MOST_FRAMES = 2000
# Modes of the motion.
_MODES = 8
# Rounds of choosing the calmer half of the markers.
_ROUNDS = 4
# Least number of markers for the head pose.
_FEWEST_CALM = 4
# Median filter of the modes [frames]: a swapped or mislabelled marker jumps for a frame or two.
_MEDIAN = 5


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
        """Indices (N,) of frames with enough markers for a pose, `_MOST_FRAMES` at most, evenly."""
        frames = np.flatnonzero(self.shown)
        return frames[:: sample_step(len(frames))]

    @property
    def shown(self) -> BoolArray:
        """(F,) bool: frames with enough markers; the scores of others only look like a rest."""
        count = visible(self.positions).sum(axis=1)
        return np.asarray(count >= min(FEWEST_MARKERS, int(count.max())))


def without_head(take: MarkerTake, kind: str) -> StabilisedTake:
    """Remove the head motion from the markers of a take in space that are ever seen.

    Raises
    ------
    InputError
        If the take is of an image, or no frame shows enough markers; it names the `kind` of
        frames that are detected.
    """
    if take.dimension != 3:
        example = "--neutral 0 30" if kind == "neutral" else "--peaks 40 75"
        raise InputError(
            f"the take {take.source} is of an image; its {kind} frames are found only where places "
            f"are proposed, too (--propose). Name them, as in {example}",
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
    some = away[:: sample_step(len(away))]
    _, _, modes = np.linalg.svd(some - some.mean(axis=0), full_matrices=False)
    scores = (away - some.mean(axis=0)) @ modes[:_MODES].T
    return StabilisedTake(still, median_filter(scores, size=(min(_MEDIAN, len(scores)), 1)))


def sample_step(count: int) -> int:
    """Return the step that leaves at most `_MOST_FRAMES` of `count` frames."""
    return max(1, -(-count // _MOST_FRAMES))
