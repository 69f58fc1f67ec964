"""The neutral frames of a take: the held pose from which the rig explains the others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.binding.held_poses import HeldPose
from usdface.binding.observations import Observations
from usdface.binding.peak_motion import Targets, unexplained_motion
from usdface.binding.registration import Registration

__all__ = ["explaining_neutral"]

# Least difference of the two faces, in expected squared errors: a hundredth of the expected error.
_LEAST = 1e-4
# Exponent of the likelihood by the markers alone: a rest may last half a second of a minute. Judge:
# `python benchmarks/neutral.py`.
_PRIOR = 0.5
# Weights of the errors in the peak frames and in the worst held pose, against 1. The same judge,
# also with rigs of twelve blend shapes and takes that rest after each of sixteen poses, and
# AnimFace's two takes in view: at 8 the neutral of Jaw on ICT is one that a person does not choose.
_PEAKS, _HELD = 4.0, 1.5


def explaining_neutral(
    held: Sequence[HeldPose],
    observed: Sequence[Observations],
    targets: Targets,
    *,
    start: Registration,
    size: float,
    away: FloatArray | float = 0.0,
) -> tuple[int, int]:
    """Return the frames of the held pose from which the rig explains the others.

    The error that the bounds of the weights add, in the peak frames and in the held pose in which
    it is largest, each as a share of the error that stays without bounds, is divided by the
    likelihood of the pose.
    Other held poses tell most: the face is near to them, so the two faces differ little in the
    motion, and from a smile or lowered lids the neutral needs negative weights. Of a pose that the
    rig has no blend shape for much stays without bounds, too: that it needs negative weights says
    little, else it would be the neutral itself, from which the others need none. The error that
    stays depends on the distance of two poses, so its least mean over all poses is added to it.

    Parameters
    ----------
    held : sequence of HeldPose, length P
    observed : sequence of Observations, length P
        K peak frames from each pose.
    targets : Targets
        Where the markers sit on the character.
    start : Registration
        Carries the markers to the character; its weights and rigid motions are of the peak frames.
    size : float [m]
        Of the character's face.
    away : (P,) float64, optional
        Mean squared distance of each pose from another rest of the performer, in units of the
        expected squared error of motion: it is added to the error in the peak frames.
    """
    poses = np.stack([pose.neutral for pose in observed])
    seen = np.stack([pose.seen for pose in observed])
    shapes = len(targets.offsets)
    start = replace(
        start,
        weights=np.concatenate([start.weights, np.zeros((len(poses), shapes))]),
        rigid=np.concatenate([start.rigid, np.zeros((len(poses), 6))]),
    )
    peaks, axes = len(observed[0].displacements), targets.offsets.shape[2]
    free, added = [], []
    for pose in observed:
        there = seen & pose.seen
        moves = np.concatenate(
            [pose.displacements, np.where(there[..., None], poses - pose.neutral, 0.0)]
        )
        visible = np.concatenate([pose.visible, there])
        moves = (moves @ start.linear)[..., :axes]
        own_free, own_added = unexplained_motion(targets, moves, visible, start=start, size=size)
        free.append(own_free)
        added.append(own_added)
    among_peaks, among_held = np.array(added)[:, :peaks], np.array(added)[:, peaks:]
    of_peaks = _shares(among_peaks + np.reshape(away, (-1, 1)), np.array(free)[:, :peaks])
    of_held = _shares(among_held, np.array(free)[:, peaks:])
    cost = 1.0 + _PEAKS * of_peaks.mean(axis=1) + _HELD * of_held.max(axis=1)
    likely = np.array([pose.likely for pose in held]) ** _PRIOR
    return held[int((cost / likely).argmin())].frames


def _shares(added: FloatArray, free: FloatArray) -> FloatArray:
    """Return the errors that bounds add, as shares of those that stay without them: (P, K) each."""
    return np.asarray(added / (max(float(free.mean(axis=1).min()), _LEAST) + free))
