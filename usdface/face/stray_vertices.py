"""Vertices of a rig that lie, or are moved by a blend shape, far off from all others."""

import numpy as np

from usdface.findings import Finding, finding
from usdface.geometry.stray_points import stray_move, stray_point, usual_size
from usdface.rigs import Rig

__all__ = ["report_stray"]


def report_stray(rig: Rig) -> list[Finding]:
    """Return POINT_STRAY for meshes and blend shapes, as `usdface check` finds it in files.

    The retarget does not depend on such vertices unless a marker is bound to one; the picture does.
    """
    findings = []
    for mesh in rig.meshes:
        if stray := stray_point(mesh.points):
            findings.append(finding("POINT_STRAY", mesh.name, *stray))
        size = usual_size(mesh.points)
        for shape in mesh.shapes:
            # Nearly all shapes stop here, without sorting.
            if np.linalg.norm(shape.offsets, axis=1).max(initial=0.0) <= size:
                continue
            if stray := stray_move(shape.offsets, shape.indices, mesh.points):
                findings.append(finding("POINT_STRAY", f"{mesh.name}/{shape.name}", *stray))
    return findings
