"""Markers without head motion, and a low-rank model of the face in them."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.low_rank_model import LowRankModel, fit_low_rank_model, reconstruct
from usdface.geometry.gap_interpolation import interpolate_gaps
from usdface.geometry.rigid_fit import Pose, rigid_fit

__all__ = ["ROUNDS", "StabilisedMarkers", "stabilise"]

# Rounds of pose and model. As all numbers of the clean-up without another source: set by hand;
# judge: `python benchmarks/cleanup.py`; docs/constants.md lists them.
ROUNDS = 4


@dataclass(frozen=True, eq=False, slots=True)
class StabilisedMarkers:
    """Markers without head motion.

    Attributes
    ----------
    pose : Pose
    positions : (F, M, 3) float64 [m]
        NaN where the take has none.
    filled : (F, M, 3) float64 [m]
        The same, reconstructed by the model where entries do not count.
    model : LowRankModel
    """

    pose: Pose
    positions: FloatArray
    filled: FloatArray
    model: LowRankModel


def stabilise(
    markers: FloatArray,
    valid: BoolArray,
    *,
    moving: bool,
    start: Pose | None = None,
    rounds: int = ROUNDS,
) -> StabilisedMarkers:
    """Fit the head pose and the low-rank model of the face in turns.

    The pose of a frame is fitted to the model's face of that frame, so that it does not move when
    a marker of an expressive face is lost.

    Parameters
    ----------
    markers : (F, M, 3) float64
        NaN where occluded.
    valid : (F, M) bool
        The entries that count; none where occluded.
    moving : bool
        False where the head motion has been removed.
    start : Pose, optional
        Initial pose; else that of a rigid fit.
    rounds : int
        Of model and pose.
    """
    known = np.where(valid[..., None], markers, np.nan)
    pose = start or Pose.identity(len(markers))
    if moving and start is None:
        pose, _ = rigid_fit(known[int(valid.sum(axis=1).argmax())], known)
    filled = _initial(pose.to_head(known), valid)
    for _ in range(rounds if moving else 1):
        model, filled = fit_low_rank_model(pose.to_head(known), valid, filled)
        if moving:
            pose, _ = rigid_fit(reconstruct(model, filled, valid), known)
    return StabilisedMarkers(pose, pose.to_head(markers), filled, model)


def _initial(positions: FloatArray, valid: BoolArray) -> FloatArray:
    """Fill gaps by straight lines, a marker without valid entries by the mean of the others."""
    frames, axes = len(positions), positions.shape[2]
    filled = positions.copy()
    never = ~valid.any(axis=0)
    if never.any():
        filled[:, never] = np.nanmean(positions[valid], axis=0)
    occluded = np.repeat(~valid, axes, axis=1)
    flat = interpolate_gaps(
        filled.reshape(frames, -1), occluded, np.arange(frames, dtype=np.float64)
    )
    return flat.reshape(positions.shape)
