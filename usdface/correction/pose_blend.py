"""The correction: expression poses blended over the solved weights."""

from collections.abc import Iterable, Sequence
from typing import get_args

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.numerics.ramps import smooth_step
from usdface.options import RESPONSE, CorrectionMode

__all__ = ["correct", "ease_antagonists", "pose_intensity", "respond"]


def correct(
    weights: FloatArray,
    emotions: FloatArray,
    poses: FloatArray,
    gains: FloatArray,
    mode: CorrectionMode = "raise",
    gain: float | FloatArray = 1.0,
    response: tuple[float, float] = RESPONSE,
) -> FloatArray:
    """Blend expression poses over weights; the result lies in [0, 1].

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
    mode : {"raise", "add"}
        "raise": max(w, max_e g r(o) P) with r the response, see `respond`. It never lowers a
        weight and is idempotent: a face that is already expressive is not raised again.
        "add": w + sum_e g o P (Zikky et al. 2013).
    gain : float or (F,) float64
        Common factor.
    response : (float, float)
        Of "raise": the output at which the pose begins to be raised, and the one from which it
        is raised fully.

    Returns
    -------
    (F, S) float64

    Raises
    ------
    InputError
        If the mode is unknown or shapes disagree.
    """
    frames, shapes = weights.shape
    expected = {"emotions": (frames, len(poses)), "poses": (len(poses), shapes)}
    if emotions.shape != expected["emotions"] or poses.shape != expected["poses"]:
        raise InputError(
            f"emotions {emotions.shape} and poses {poses.shape} do not fit weights {weights.shape}"
        )
    if gains.shape not in ((len(poses),), (frames, len(poses))):
        raise InputError(f"gains have shape {gains.shape} for {len(poses)} emotions")
    if mode not in get_args(CorrectionMode):
        raise InputError(f"correction mode is {mode!r}; expected raise or add")
    intensity = pose_intensity(emotions, gains, mode, gain, response)
    corrected = np.array(weights, dtype=np.float64)
    for own, pose in zip(intensity.T, poses, strict=True):
        moved = np.flatnonzero(pose)
        scaled = own[:, None] * pose[moved]
        if mode == "add":
            corrected[:, moved] += scaled
        else:
            corrected[:, moved] = np.maximum(corrected[:, moved], scaled)
    return np.clip(corrected, 0.0, 1.0)


def pose_intensity(
    emotions: FloatArray,
    gains: FloatArray,
    mode: CorrectionMode,
    gain: float | FloatArray,
    response: tuple[float, float],
) -> FloatArray:
    """Return the share of its pose that each emotion gets (F, E); parameters as `correct`."""
    driven = emotions if mode == "add" else respond(emotions, response)
    return np.asarray(driven * (gains * np.reshape(gain, (-1, 1))))


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
        Solved weights, and those of the expression poses alone (`correct` over weights of 0).
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
