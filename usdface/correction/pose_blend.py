"""Blending expression poses over solved weights: addition, response, antagonists."""

from collections.abc import Iterable, Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.numerics.ramps import smooth_step

__all__ = ["add_poses", "ease_antagonists", "pose_intensity", "respond"]


def add_poses(
    weights: FloatArray,
    emotions: FloatArray,
    poses: FloatArray,
    gains: FloatArray,
    gain: float | FloatArray,
) -> FloatArray:
    """Add expression poses to weights: w + sum_e g o P, limited to [0, 1] (Zikky et al. 2013).

    Parameters
    ----------
    weights : (F, S) float64
        Solved weights w, in [0, 1].
    emotions : (F, E) float64
        Fuzzy outputs o, in [0, 1].
    poses : (E, S) float64
        Expression poses P, in [0, 1].
    gains : (E,) or (F, E) float64
        One gain for each emotion, constant or by frame; times `gain` it is g.
    gain : float or (F,) float64
        Common factor.

    Returns
    -------
    (F, S) float64
    """
    intensity = pose_intensity(emotions, gains, gain)
    corrected = np.array(weights, dtype=np.float64)
    for own, pose in zip(intensity.T, poses, strict=True):
        moved = np.flatnonzero(pose)
        corrected[:, moved] += own[:, None] * pose[moved]
    return np.clip(corrected, 0.0, 1.0)


def pose_intensity(emotions: FloatArray, gains: FloatArray, gain: float | FloatArray) -> FloatArray:
    """Return the share of its pose that is added for each emotion (F, E); see `add_poses`."""
    return np.asarray(emotions * (gains * np.reshape(gain, (-1, 1))))


def respond(emotions: FloatArray, response: tuple[float, float]) -> FloatArray:
    """Return the share of its pose that an emotion gets: a smooth step, 0 to 1.

    Weak emotions are meant fully; outputs below the onset are speech, or noise. The slope is 0 at
    both ends, so that a correction begins and ends smoothly.

    Parameters
    ----------
    emotions : (...) float64
        Fuzzy outputs.
    response : (onset, full)
        With 0 <= onset < full.
    """
    onset, full = response
    return smooth_step((emotions - onset) / (full - onset))


def ease_antagonists(
    weights: FloatArray,
    raised: FloatArray,
    names: Sequence[str],
    pairs: Iterable[tuple[str, str]],
    amount: float,
) -> FloatArray:
    """Return weights limited by their raised antagonists.

    A blend shape that is raised to r limits its antagonist to 1 - `amount` r. The limit depends on
    the raised weights only, so the function is idempotent.

    Parameters
    ----------
    weights, raised : (F, S) float64
        Solved weights, and those of the expression poses alone.
    names : sequence of str, length S
    pairs : iterable of (str, str)
        Antagonists: blend shapes that move the same skin in opposite directions.
    amount : float
        0 to 1; 0 changes nothing.
    """
    index = {name: i for i, name in enumerate(names)}
    limit = np.ones(weights.shape)
    for one, other in pairs:
        if amount > 0 and one in index and other in index:
            for a, b in ((index[one], index[other]), (index[other], index[one])):
                limit[:, b] = np.minimum(limit[:, b], 1.0 - amount * raised[:, a])
    return np.minimum(weights, limit)
