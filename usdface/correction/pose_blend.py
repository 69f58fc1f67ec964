"""The correction: expression poses blended over the solved weights."""

from collections.abc import Iterable, Sequence
from typing import get_args

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.options import RESPONSE, CorrectionMode

__all__ = ["correct", "eased", "pose_shares", "respond"]


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
        One gain for each emotion, maybe over time; with `gain` it gives g.
    mode : {"raise", "add"}
        "raise": max(w, max_e g r(o) P) with r the response, see `respond`. It never
        lowers a weight, and doing it twice is doing it once: a face that is already expressive
        is not pushed again.
        "add": w + sum_e g o P (Zikky et al. 2013).
    gain : float or (F,) float64
        Common factor.
    response : (float, float)
        Of "raise": the output below which nothing is corrected, and the one from which on the
        whole pose is shown.

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
    driven = pose_shares(emotions, gains, mode, gain, response)
    corrected = np.array(weights, dtype=np.float64)
    for drive, pose in zip(driven.T, poses, strict=True):
        moved = np.flatnonzero(pose)
        shown = drive[:, None] * pose[moved]
        if mode == "add":
            corrected[:, moved] += shown
        else:
            corrected[:, moved] = np.maximum(corrected[:, moved], shown)
    return np.clip(corrected, 0.0, 1.0)


def pose_shares(
    emotions: FloatArray,
    gains: FloatArray,
    mode: CorrectionMode,
    gain: float | FloatArray,
    response: tuple[float, float],
) -> FloatArray:
    """Return how much of its pose each emotion is given (F, E); parameters as `correct`."""
    driven = emotions if mode == "add" else respond(emotions, response)
    return np.asarray(driven * (gains * np.reshape(gain, (-1, 1))))


def respond(emotions: FloatArray, response: tuple[float, float]) -> FloatArray:
    """Return how much of its pose an emotion is given: a smooth step, 0 to 1.

    A performer who shows little of an emotion means all of it; what is below the onset is
    speech, or nothing. Both ends are level, so a correction begins and ends without a jerk.

    Parameters
    ----------
    emotions : (...) float64
        Fuzzy outputs.
    response : (onset, full)
        With 0 <= onset < full.
    """
    onset, full = response
    x = np.clip((emotions - onset) / (full - onset), 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))


def eased(
    weights: FloatArray,
    raised: FloatArray,
    names: Sequence[str],
    pairs: Iterable[tuple[str, str]],
    amount: float,
) -> FloatArray:
    """Return weights of which none exceeds what its antagonists leave it.

    A shape that is raised to r leaves its antagonist 1 - `amount` r. That hangs on what is
    raised alone, so easing twice is easing once.

    Parameters
    ----------
    weights, raised : (F, S) float64
        Solved weights, and what the expressions ask for (`correct` over weights of 0).
    names : sequence of str, length S
    pairs : iterable of (str, str)
        Shapes that move the same skin in opposite directions.
    amount : float
        0 to 1; 0 changes nothing.
    """
    index = {name: i for i, name in enumerate(names)}
    room = np.ones(weights.shape)
    for one, other in pairs:
        if amount > 0 and one in index and other in index:
            for a, b in ((index[one], index[other]), (index[other], index[one])):
                room[:, b] = np.minimum(room[:, b], 1.0 - amount * raised[:, a])
    return np.minimum(weights, room)
