"""The size of a face against that of people: wrong units make it ten times as large, or more.

Constants: the blend shapes of three heads in metres (ICT-FaceKit, MakeHuman, the example) move
regions that are 0.06 to 0.15 m across in the median; a third of the least and three times the most
are allowed, so that children and stylised characters pass and a factor of ten does not.
"""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.eye_sides import is_left_lid
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.findings import Finding, finding
from usdface.rigs import Mesh, Rig

__all__ = ["human_size", "moved_size", "report_size", "size_by_eyes"]

# Mean distance between the pupils of adults (N. Dodgson, "Variation and extrema of human
# interpupillary distance", 2004): here between the middles of both eyes' lids. ICT-FaceKit,
# MakeHuman and the example are 1.04, 0.98 and 1.06.
_EYES_APART = 0.063  # [m]
_LEAST, _MOST = 0.02, 0.45  # [m]
_MOVED = 0.1  # of the largest offset of a shape: vertices that move less do not count


def size_by_eyes(points: FloatArray, lids: IntArray) -> float:
    """Return the size of a face in human ones, by the distance between its eyes; NaN if unknown.

    Parameters
    ----------
    points : (V, 3) float64 [m]
    lids : (P, 2) int64
        Pairs of vertices that touch in closed eyes.
    """
    if not len(lids):
        return np.nan
    middles = points[lids].mean(axis=1)
    left = is_left_lid(points, lids)
    if left.all() or not left.any():
        return np.nan
    apart = np.linalg.norm(middles[left].mean(axis=0) - middles[~left].mean(axis=0))
    return float(apart) / _EYES_APART


def human_size(mesh: Mesh) -> float:
    """Return the size of a face in human ones by its own lids; 1 where it shows none."""
    size = size_by_eyes(mesh.points, find_lip_lid_contacts(mesh).lids)
    return size if size > 0.0 else 1.0


def moved_size(rig: Rig) -> float:
    """Return the median size of the regions that the blend shapes of the face move [m].

    0 where none moves anything.
    """
    mesh = max(rig.meshes, key=lambda mesh: len(mesh.shapes), default=None)
    sizes = []
    for shape in mesh.shapes if mesh is not None else ():
        length = np.linalg.norm(shape.offsets, axis=1)
        moved = shape.indices[length > _MOVED * length.max(initial=0.0)]
        if mesh is not None and len(moved) > 1:
            sizes.append(float(np.linalg.norm(np.ptp(mesh.points[moved], axis=0))))
    return float(np.median(sizes)) if sizes else 0.0


def report_size(rig: Rig) -> list[Finding]:
    """Return RIG_SIZE_UNUSUAL where the face is far larger or smaller than a human one."""
    size = moved_size(rig)
    if not size or _LEAST <= size <= _MOST:
        return []
    message = (
        "a blend shape moves a region {size_m:.3g} m across; on a human face about 0.1 "
        "m: is the unit of length right?"
    )
    return [finding("RIG_SIZE_UNUSUAL", rig.source or rig.name, message, size)]
