"""Displacements of the markers by the blend shapes that move the lids of an eye.

A rig may close an eye by the rim of its lid alone, where no marker is, while a performer's blink
moves the skin around it, with markers. Then the displacements are those of a face made from scans
(`usdface.face.face_motion`).
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.closure.lid_apertures import LidApertures
from usdface.face.bound_face import BoundFace
from usdface.face.expression_poses import units_of
from usdface.face.face_motion import motion_at

__all__ = [
    "closing_displacements",
    "near_lids",
    "scanned_glance_displacements",
    "scanned_lid_displacements",
]

# A marker that the closing shape moves by less, as a share of the farthest, does not count.
_MOVED = 0.15
# Openings of the eye: if the closing shape moves no marker by as much, none is near the lids.
# AnimFace's markers on the lids move by 0.48 on ICT, landmarks on the rims by 1.
_NEAR = 0.1
# The one rig of the table that is made of scans; the others are drawn.
_SCANNED = "ICT"
# FACS: 5 raises the upper lid, 7 tightens the lids, 43 closes the eyes, 64 is eyes that look down.
_RAISED, _TIGHTENED, _CLOSED, _GLANCED = 5, 7, 43, 64


def closing_displacements(
    face: BoundFace, apertures: LidApertures, names: tuple[str, ...], markers: tuple[str, ...]
) -> FloatArray:
    """Return the displacement of each marker by the shape that closes an eye: (M, 3) [m].

    `apertures` are of the blend shapes `names`. As on the scanned face if the shape moves none.
    """
    order = [face.markers.index(name) for name in markers]
    another = scanned_lid_displacements(face, apertures, names)
    return another.get(apertures.closer, _own_closing(face, apertures, names))[order]


def near_lids(closing: FloatArray, apertures: LidApertures) -> BoolArray:
    """Return which markers the lids of an eye move: (M,), by their closing displacements (M, 3)."""
    size = np.linalg.norm(closing, axis=1)
    farthest = size.max(initial=0.0)
    return np.asarray((farthest >= _NEAR * apertures.opening) & (size >= _MOVED * farthest))


def scanned_lid_displacements(
    face: BoundFace, apertures: LidApertures, names: tuple[str, ...]
) -> dict[int, FloatArray]:
    """Return the displacements of a face's markers by the lids of an eye, as on the scanned face.

    Parameters
    ----------
    face : BoundFace
    apertures : LidApertures
        Of the blend shapes `names`.
    names : tuple of str, length T

    Returns
    -------
    dict of int to (M, 3) float64
        For the blend shapes that close the eye, tighten its lids, or raise the upper one [m].
        Empty where the first of them moves a marker, or no marker is near the lids.
    """
    if near_lids(_own_closing(face, apertures, names), apertures).any():
        return {}
    moved = _as_scanned(face, apertures)
    if not moved or not near_lids(moved[_CLOSED], apertures).any():
        return {}
    return {
        apertures.closer: moved[_CLOSED],
        **dict.fromkeys(apertures.tighteners, moved[_TIGHTENED]),
        **dict.fromkeys(apertures.raisers, moved[_RAISED]),
    }


def scanned_glance_displacements(
    face: BoundFace, apertures: LidApertures, names: tuple[str, ...]
) -> FloatArray | None:
    """Return the displacements of a face's markers by a glance down of the scanned face.

    (M, 3) [m]. A performer's upper lids follow the gaze; on most characters only the eyeballs do.
    None where the rig's own glance down moves markers near the lids, or the scanned face's does
    not.

    Parameters
    ----------
    face : BoundFace
    apertures : LidApertures
        Of the blend shapes `names`.
    names : tuple of str, length T
    """
    own = [name for name, units in units_of(names).items() if _GLANCED in units]
    glances = [face.offsets[face.shape_names.index(name)] for name in own]
    moved = _as_scanned(face, apertures).get(_GLANCED)
    if moved is None or any(near_lids(glance, apertures).any() for glance in glances):
        return None
    return moved if near_lids(moved, apertures).any() else None


def _as_scanned(face: BoundFace, apertures: LidApertures) -> dict[int, FloatArray]:
    """Return the displacements of an eye's side's markers by each action unit of a scanned face."""
    known = (motion_at(face, (_SCANNED,)) or {}).get(_SCANNED, {})
    # Markers on the midline belong to neither eye: a mirrored face has the mirrored result.
    to_left = face.neutral[:, 0] - face.midline
    own = to_left > 0.0 if apertures.eye == "left" else to_left < 0.0
    return {unit: own[:, None] * by_unit for unit, by_unit in known.items()}


def _own_closing(face: BoundFace, apertures: LidApertures, names: tuple[str, ...]) -> FloatArray:
    return np.asarray(face.offsets[face.shape_names.index(names[apertures.closer])])
