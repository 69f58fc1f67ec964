"""The neutral frames of a take: the held pose from which the rig explains the others."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.binding.neutral_frames import HeldPose
from usdface.binding.observations import Observations
from usdface.binding.peak_motion import Targets, unexplained_motion
from usdface.binding.registration import Registration

__all__ = ["explaining_neutral"]


def explaining_neutral(
    held: Sequence[HeldPose],
    observed: Sequence[Observations],
    targets: Targets,
    *,
    start: Registration,
    size: float,
    away: FloatArray | float = 0.0,
) -> tuple[int, int]:
    """Return the frames of the held pose from which the rig explains the peak frames.

    The error added by the bounds of the weights, plus the difference of the two faces, is divided
    by the likelihood of the pose. The difference depends on the distance of a pose to the peaks, so
    its minimum over all poses is used.

    Parameters
    ----------
    held : sequence of HeldPose, length P
    observed : sequence of Observations, length P
        The peak frames from each pose.
    targets : Targets
        Where the markers sit on the character.
    start : Registration
        As in `unexplained_motion`.
    size : float [m]
        Of the character's face.
    away : (P,) float64, optional
        Mean squared distance of each pose from another rest of the performer, in units of the
        expected squared error of motion: it is added to the error.
    """
    left = np.array([unexplained_motion(targets, o, start=start, size=size) for o in observed])
    difference, bounded = left[:, 0].min(), left[:, 1]
    likely = np.array([pose.likely for pose in held])
    return held[int(((difference + bounded + away) / likely).argmin())].frames
