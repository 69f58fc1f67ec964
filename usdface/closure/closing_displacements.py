"""Displacements of the markers by the blend shapes that move the lids of an eye.

A performer's blink moves the skin around the eye as people's lids do. A character's may not: its
eyes are twice as large, or it closes them by the rim of the lid alone, where no marker is. Then the
displacements are those of a face made from scans (`usdface.face.face_motion`).
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
# Mean distance between the lids of the ICT face, if it were as large as a human one [m].
_HUMAN_OPENING = 0.0075
# Lids move unlike people's if the displacements of a closed eye differ from the scanned face's by
# more than this share of them. ICT with its own markers 0.08, with proposed or misplaced ones at
# most 0.26; MakeHuman and the example 0.54 and more.
_UNLIKE = 0.5
# The one rig of the table that is made of scans; the others are drawn.
_SCANNED = "ICT"
# FACS: 5 raises the upper lid, 7 tightens the lids, 43 closes the eyes, 64 is eyes that look down.
_RAISED, _TIGHTENED, _CLOSED, _GLANCED = 5, 7, 43, 64


def closing_displacements(
    face: BoundFace,
    apertures: LidApertures,
    names: tuple[str, ...],
    markers: tuple[str, ...],
    *,
    of_rig: bool = False,
) -> FloatArray:
    """Return the displacement of each marker by the shape that closes an eye: (M, 3) [m].

    `apertures` are of the blend shapes `names`. As on the scanned face if the shape moves them
    otherwise (`scanned_lid_displacements`); `of_rig`: only if it moves none.
    """
    order = [face.markers.index(name) for name in markers]
    if of_rig and _lids_move_markers(face, apertures, names):
        return _own_closing(face, apertures, names)[order]
    another = scanned_lid_displacements(face, apertures, names)
    return another.get(apertures.closer, _own_closing(face, apertures, names))[order]


def near_lids(face: BoundFace, apertures: LidApertures, closing: FloatArray) -> BoolArray:
    """Return which markers the lids of an eye move: (M,), by their closing displacements (M, 3)."""
    size = np.linalg.norm(closing, axis=1)
    farthest = size.max(initial=0.0)
    # No performer's lids move further than a person's, however large the character's eyes are.
    opening = min(apertures.opening, _HUMAN_OPENING * face.size)
    return np.asarray((farthest >= _NEAR * opening) & (size >= _MOVED * farthest))


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
        Empty where the first of them moves the markers much like the scanned face's, or no marker
        is near the lids.
    """
    moved = _as_scanned(face, apertures)
    if not moved or not near_lids(face, apertures, moved[_CLOSED]).any():
        return {}
    # One shape may close both eyes.
    own = _of_eye(face, apertures)[:, None] * _own_closing(face, apertures, names)
    if np.linalg.norm(own - moved[_CLOSED]) <= _UNLIKE * np.linalg.norm(moved[_CLOSED]):
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
    None where the rig's lids move as the scanned face's and its own glance down moves markers near
    them, or where the scanned face's does not.

    Parameters
    ----------
    face : BoundFace
    apertures : LidApertures
        Of the blend shapes `names`.
    names : tuple of str, length T
    """
    moved = _as_scanned(face, apertures).get(_GLANCED)
    if moved is None or not near_lids(face, apertures, moved).any():
        return None
    if scanned_lid_displacements(face, apertures, names):
        return moved
    own = [name for name, units in units_of(names).items() if _GLANCED in units]
    glances = [face.offsets[face.shape_names.index(name)] for name in own]
    return None if any(near_lids(face, apertures, glance).any() for glance in glances) else moved


def _as_scanned(face: BoundFace, apertures: LidApertures) -> dict[int, FloatArray]:
    """Return the displacements of an eye's side's markers by each action unit of a scanned face."""
    known = (motion_at(face, (_SCANNED,)) or {}).get(_SCANNED, {})
    own = _of_eye(face, apertures)[:, None]
    return {unit: own * by_unit for unit, by_unit in known.items()}


def _of_eye(face: BoundFace, apertures: LidApertures) -> BoolArray:
    """Return which markers are on an eye's side: (M,)."""
    # Those on the midline belong to neither eye: a mirrored face has the mirrored result.
    to_left = face.neutral[:, 0] - face.midline
    return np.asarray(to_left > 0.0 if apertures.eye == "left" else to_left < 0.0)


def _lids_move_markers(face: BoundFace, apertures: LidApertures, names: tuple[str, ...]) -> bool:
    """Whether the rig's own lids move markers, so that a solve determines them."""
    own = _own_closing(face, apertures, names)
    return bool(near_lids(face, apertures, own).any())


def _own_closing(face: BoundFace, apertures: LidApertures, names: tuple[str, ...]) -> FloatArray:
    return np.asarray(face.offsets[face.shape_names.index(names[apertures.closer])])
