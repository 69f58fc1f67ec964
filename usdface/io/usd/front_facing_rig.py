"""The rig of a stage, turned for its face to look along +z."""

from pathlib import Path

import numpy as np
from pxr import Usd

from usdface.arrays import FloatArray, IntArray
from usdface.face.facing import (
    SLIGHT,
    facing,
    has_equal_halves,
    turn_about_up,
    turn_to_front,
    yaw_of,
)
from usdface.findings import Finding, finding
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.skel_bindings import spaces_of_meshes
from usdface.rigs import Rig

__all__ = ["front_facing_rig"]

# A face that is turned aside by less [degrees] looks ahead: rounding of transforms.
_AHEAD = 0.01
_NO_MARKERS: IntArray = np.zeros(0, dtype=np.int64)


def front_facing_rig(
    stage: Usd.Stage,
    root: str = "",
    *,
    joints: bool = False,
    asset_root: Path | None = None,
    mesh: str = "",
    markers: IntArray = _NO_MARKERS,
) -> tuple[Rig, FloatArray, list[Finding]]:
    """Return the rig of a stage, turned for its face to look along +z, and the turn (4, 4).

    A shot keeps the stage itself: cameras, variants and others that a rig lacks are not lost.

    Parameters
    ----------
    stage : Usd.Stage
    root : str
    joints : bool
    asset_root : Path, optional
        These three as of `usdface.io.usd.rig.rig_of_stage`.
    mesh : str
        Of the face; "" = found.
    markers : (B,) int64
        Vertices of markers, which tell its side; without any its blend shapes do.

    Returns
    -------
    Rig
    (4, 4) float64
        For row vectors.
    list of Finding
        CHARACTER_TURNED, if it is; CHARACTER_LYING.
    """
    rig, findings = rig_of_stage(stage, root, joints, asset_root, referenced=True)
    if not any(each.shapes for each in rig.meshes):
        return rig, np.eye(4), findings
    face = rig.mesh(mesh) if mesh else rig.face()
    looks, pitch = facing(face, markers)
    if pitch is not None:
        message = (
            "the face has a pitch of {pitch_degrees:.0f} degrees, as if it lay; its regions and "
            "features are those of an upright one: correct the upAxis of its file, or turn it "
            "upright there"
        )
        findings = [*findings, finding("CHARACTER_LYING", face.path, message, pitch)]
    if looks is None:
        return rig, np.eye(4), findings
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        placed = spaces_of_meshes(stage)[face.path]
    # Not of one that looks ahead, as most do: it takes a while.
    own = facing(face, _NO_MARKERS).yaw if abs(looks) > SLIGHT else None
    equal = own is not None and has_equal_halves(face, own)
    degrees = turn_to_front(looks, yaw_of(placed), own, equal=equal)
    if abs(degrees) < _AHEAD:
        return rig, np.eye(4), findings
    turn = turn_about_up(degrees)
    rig, findings = rig_of_stage(stage, root, joints, asset_root, turn=turn, referenced=True)
    message = (
        "the face looks {turned_degrees:.0f} degrees to the side; it is solved, and written as "
        "glTF, as if it looked along +z"
    )
    return rig, turn, [*findings, finding("CHARACTER_TURNED", face.path, message, abs(degrees))]
