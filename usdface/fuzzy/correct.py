"""The correction: expression poses blended over the solved weights."""

from typing import get_args

import numpy as np

from usdface.errors import InputError
from usdface.options import CorrectionMode
from usdface.takes import FloatArray

__all__ = ["correct"]


def correct(
    weights: FloatArray,
    emotions: FloatArray,
    poses: FloatArray,
    gains: FloatArray,
    mode: CorrectionMode = "raise",
    gain: float = 1.0,
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
    gains : (E,) float64
        One gain for each emotion; with `gain` it gives g.
    mode : {"raise", "add"}
        "raise": max(w, max_e g o P). It never lowers a weight, and doing it twice is doing it
        once: a face that is already expressive is not pushed again.
        "add": w + sum_e g o P (Zikky et al. 2013).
    gain : float
        Common factor.

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
    if gains.shape != (len(poses),):
        raise InputError(f"there are {gains.size} gains for {len(poses)} emotions")
    if mode not in get_args(CorrectionMode):
        raise InputError(f"correction mode is {mode!r}; expected raise or add")
    combine = np.maximum if mode == "raise" else np.add
    driven = emotions * (gains * gain)
    corrected = np.array(weights, dtype=np.float64)
    for drive, pose in zip(driven.T, poses, strict=True):
        moved = np.flatnonzero(pose)
        corrected[:, moved] = combine(corrected[:, moved], drive[:, None] * pose[moved])
    return np.clip(corrected, 0.0, 1.0)
