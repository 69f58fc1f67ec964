"""Neutral and peak frames of a take that is not bound yet: held poses and strong expressions."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import IntArray
from usdface.binding.held_poses import held_poses
from usdface.binding.stabilised_take import FEWEST_MARKERS, StabilisedTake, without_head
from usdface.errors import InputError
from usdface.retarget.film.film_head import FEWEST_FILMED
from usdface.setup.retarget_setup import check_neutral_frames
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "check_frames",
    "distant_frames",
    "neutral_frames",
    "peak_frames",
    "shows_poses",
]

# Peak frames that are detected; judge: `python benchmarks/binding.py`.
_MOST_PEAKS = 24
# Least distance of a peak from neutral and other peaks, as a share of the farthest one's. Set by
# hand.
_LEAST_PEAK = 0.02


def shows_poses(take: MarkerTake, bound: Sequence[str]) -> bool:
    """Return whether a frame shows enough markers for neutral frames; of an image bound ones."""
    if take.dimension == 3:
        return int(take.visible.sum(axis=1).max()) >= FEWEST_MARKERS
    own = np.isin(take.names, list(bound))
    return int(take.visible[:, own].sum(axis=1).max()) >= FEWEST_FILMED


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
    return tuple(distant_frames(without_head(take, "peak"), neutral).tolist())


def check_frames(
    take: MarkerTake | WeightsTake, neutral: tuple[int, int] | None, peaks: Sequence[int]
) -> None:
    """Check that the take has the neutral and peak frames.

    Raises
    ------
    InputError
        Naming the first that it does not have.
    """
    if neutral:
        check_neutral_frames(neutral, len(take.times), take.source)
    if max(peaks, default=0) >= len(take.times):
        raise InputError(
            f"the peak frame {max(peaks)} lies outside the take {take.source}, which has frames 0 "
            f"to {len(take.times) - 1}; name others (--peaks FRAME ..., or auto)",
            "FRAMES_OUTSIDE",
        )


def distant_frames(stabilised: StabilisedTake, neutral: tuple[int, int]) -> IntArray:
    """Return frame indices (K,) far from `neutral`, first to last, and from each other.

    The farthest first.
    """
    scores, frames = stabilised.scores, stabilised.sampled
    some = scores[frames]
    mean = scores[neutral[0] : neutral[1] + 1].mean(axis=0)
    far = np.linalg.norm(some - mean, axis=1)
    least = _LEAST_PEAK * float(far.max(initial=0.0))
    peaks: list[int] = []
    while len(peaks) < min(_MOST_PEAKS, len(some)) and far.max() > least:
        peaks.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(some - some[peaks[-1]], axis=1))
    return frames[np.array(peaks, dtype=np.int64)]
