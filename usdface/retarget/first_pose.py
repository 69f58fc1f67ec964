"""The head's pose before a solve: the head markers' rigid fit, or that of all markers."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose, rigid_fit
from usdface.options import HeadMode
from usdface.retarget.neutral import on_plane
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, visible

__all__ = ["first_pose", "head_markers_few", "in_posed_frames", "shows_pose"]


def first_pose(
    take: MarkerTake,
    positions: FloatArray,
    neutral: FloatArray,
    setup: RetargetSetup,
    head_neutral: FloatArray,
) -> tuple[Pose, BoolArray]:
    """Return the head's pose before the solve: a rigid fit, or that of the head markers.

    And the frames (F,) that determine it. In others the markers tell nothing of the face.

    Parameters
    ----------
    take : MarkerTake
    positions : (F, M, D) float64
        Of the markers that are used.
    neutral : (M, D) float64
    setup : RetargetSetup
    head_neutral : (H, D) float64
        Where its head markers rest.
    """
    if setup.head == "stabilised":
        return Pose.identity(len(positions)), np.ones(len(positions), dtype=bool)
    if setup.head == "solve":
        return rigid_fit(on_plane(neutral), on_plane(positions))
    rigid = take.select(setup.head_markers)
    return rigid_fit(on_plane(head_neutral), on_plane(rigid))


def shows_pose(
    take: MarkerTake, seen: BoolArray, head: HeadMode, head_markers: tuple[str, ...]
) -> BoolArray:
    """Return the frames (F,) that show enough markers for the head's pose, as `first_pose` has it.

    `seen` (F, M) are the markers that are used.
    """
    if head == "stabilised":
        return np.ones(len(seen), dtype=bool)
    shown = visible(take.select(head_markers)) if head == "markers" else seen
    return np.asarray(shown.sum(axis=1) >= POSE_MARKERS)


def in_posed_frames(positions: FloatArray, posed: BoolArray) -> FloatArray:
    """Return markers (F, M, D), NaN in frames (F,) that do not determine the head's pose."""
    return positions if posed.all() else np.where(posed[:, None, None], positions, np.nan)


def head_markers_few(usable: BoolArray, source: str) -> list[Finding]:
    """Report frames (F,) in which too few markers determine the head pose."""
    if usable.all():
        return []
    missing = int((~usable).sum())
    return [
        finding(
            "HEAD_MARKERS_FEW",
            source,
            "fewer than three head markers, or only some in a line, in {few_count} of "
            "{frame_count} frames; head and face follow their neighbours there",
            missing,
            len(usable),
        )
    ]
