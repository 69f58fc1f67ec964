"""Markers without the head's motion, and the model of the face that they show."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.low_rank_model import FaceModel, fit_model, restore
from usdface.geometry.rigid_fit import Pose, rigid_fit

__all__ = ["Steady", "steady"]


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A take that is held still.

    Attributes
    ----------
    pose : Pose
    still : (F, M, 3) float64
        Markers without the head's motion, NaN where the take has none.
    filled : (F, M, 3) float64
        The same, and what the model says where entries are not believed.
    model : FaceModel
    """

    pose: Pose
    still: FloatArray
    filled: FloatArray
    model: FaceModel


def steady(
    markers: FloatArray,
    believed: BoolArray,
    moving: bool,
    start: Pose | None = None,
    rounds: int = 4,
) -> Steady:
    """Find the head's pose and the model of the face together.

    The pose of a frame is fitted to what the model makes of that frame's face, so that it does
    not move when a marker of an expressive face is lost.

    Parameters
    ----------
    markers : (F, M, 3) float64
        NaN where occluded.
    believed : (F, M) bool
        The entries that count; none where occluded.
    moving : bool
        False where the head is still already.
    start : Pose, optional
        A pose to start from.
    rounds : int
    """
    known = np.where(believed[..., None], markers, np.nan)
    pose = start or Pose.identity(len(markers))
    if moving and start is None:
        pose, _ = rigid_fit(known[int(believed.sum(axis=1).argmax())], known)
    filled = _bridged(pose.to_head(known), believed)
    for _ in range(rounds if moving else 1):
        model, filled = fit_model(pose.to_head(known), believed, filled)
        if moving:
            pose, _ = rigid_fit(restore(model, filled, believed), known)
    return Steady(pose, pose.to_head(markers), filled, model)


def _bridged(still: FloatArray, believed: BoolArray) -> FloatArray:
    """Join the ends of all gaps by straight lines, for a start."""
    filled = still.copy()
    frames = np.arange(len(still))
    for m in np.flatnonzero(~believed.all(axis=0)):
        gap = ~believed[:, m]
        if gap.all():
            filled[:, m] = np.nanmean(still[believed], axis=0)
            continue
        for d in range(still.shape[2]):
            filled[gap, m, d] = np.interp(frames[gap], frames[~gap], still[~gap, m, d])
    return filled
