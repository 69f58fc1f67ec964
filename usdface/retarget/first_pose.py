"""The head's pose before a solve: the head markers' rigid fit, or that of all markers."""

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.retarget.neutral import on_plane
from usdface.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["first_pose", "head_markers_few"]


def first_pose(
    take: MarkerTake,
    positions: FloatArray,
    neutral: FloatArray,
    setup: RetargetSetup,
    head_neutral: FloatArray,
) -> tuple[Pose, list[Finding]]:
    """Return the head's pose before the solve: a rigid fit, or that of the head markers.

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
        return Pose.identity(len(positions)), []
    if setup.head == "solve":
        pose, usable = rigid_fit(on_plane(neutral), on_plane(positions))
    else:
        rigid = take.select(setup.head_markers)
        pose, usable = rigid_fit(on_plane(head_neutral), on_plane(rigid))
    return pose, head_markers_few(usable, take.source)


def head_markers_few(usable: BoolArray, source: str) -> list[Finding]:
    """Report frames (F,) in which too few markers determine the head pose."""
    if usable.all():
        return []
    missing = int((~usable).sum())
    return [
        finding(
            "HEAD_MARKERS_FEW",
            source,
            "fewer than three head markers in {few_count} of {frame_count} frames; the head "
            "keeps the pose of the nearest frame there",
            missing,
            len(usable),
        )
    ]
