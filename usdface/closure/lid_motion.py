"""Motion of the upper lids by themselves, apart from the skin around them.

A lowered brow takes the skin over the lid along, with any marker on it: the marker moves as in a
blink while the eye stays open. Markers beside it that the lids do not move measure the motion of
the skin; the rest is the lid's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.closure.closing_displacements import closing_displacements, near_lids
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.face.bound_face import BoundFace
from usdface.numerics.frame_blocks import frame_blocks
from usdface.retarget.solution import Solution

__all__ = ["LidMarker", "lid_markers", "lid_motion"]

# A marker that the closing shape moves by more than this share of the farthest is on the lid that
# closes. On the three faces those on the other lid move by 0.2.
_ON_LID = 0.5
# Markers around it, weighted by the inverse square of their distance (Shepard 1968); fewer than
# the second do not surround it. Set by hand.
_AROUND, _FEWEST = 6, 3


@dataclass(frozen=True, eq=False, slots=True)
class LidMarker:
    """A marker on the lid that closes an eye.

    Attributes
    ----------
    eye : {"left", "right"}
    marker : int
        Of the solution's markers, as all below.
    closing : (3,) float64 [m]
        Its displacement by the shape that closes the eye.
    around : (K,) int64
        Markers around it that the lids do not move.
    shares : (K,) float64
        Of each of them in the motion of the skin: 1 together.
    """

    eye: Eye
    marker: int
    closing: FloatArray
    around: IntArray
    shares: FloatArray

    def skin(self, displacements: FloatArray) -> FloatArray:
        """Return by how much the skin around it moves: (F, 3) [m], of all markers (F, M, 3)."""
        return np.asarray(np.einsum("fkd,k->fd", displacements[:, self.around], self.shares))

    def closed(self, moved: FloatArray) -> FloatArray:
        """Return how far displacements (F, 3) close the eye: (F,), 1 as its shape does."""
        return np.asarray(moved @ self.closing / (self.closing**2).sum())


def lid_markers(
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures],
    names: tuple[str, ...],
    solution: Solution,
    *,
    of_rig: bool = False,
) -> list[LidMarker]:
    """Return the markers on the lids that close the eyes, those with others around them.

    Parameters
    ----------
    face : BoundFace
    by_eye : mapping of "left", "right" to LidApertures
    names : tuple of str, length T
        The blend shapes that `by_eye` is of.
    solution : Solution
    of_rig : bool
        Closed as the rig's shape has it, also where people's lids move otherwise.
    """
    closing = {
        eye: closing_displacements(face, apertures, names, solution.markers, of_rig=of_rig)
        for eye, apertures in by_eye.items()
    }
    moved = np.zeros(len(solution.markers), dtype=bool)
    for eye, each in closing.items():
        moved |= near_lids(face, by_eye[eye], each)
    still = np.flatnonzero(~moved)
    found: list[LidMarker] = []
    if len(still) < _FEWEST:
        return found
    for eye in (eye for eye in EYES if eye in closing):
        size = np.linalg.norm(closing[eye], axis=1)
        near = near_lids(face, by_eye[eye], closing[eye])
        on_lid = near & (size > _ON_LID * size.max(initial=0.0))
        for marker in np.flatnonzero(on_lid).tolist():
            apart = np.linalg.norm(solution.rest[still] - solution.rest[marker], axis=1)
            nearest = np.argsort(apart, kind="stable")[:_AROUND]
            shares = 1.0 / np.maximum(apart[nearest], 1e-9) ** 2
            own = closing[eye][marker]
            found.append(LidMarker(eye, marker, own, still[nearest], shares / shares.sum()))
    return found


def lid_motion(lids: list[LidMarker], solution: Solution) -> FloatArray:
    """Return how far each eye's lid closes by itself: (F, 2), NaN for an eye without lid markers.

    1 is the closed eye of the character; as `lid_signal`, less the motion of the skin around.
    """
    motion = np.full((len(solution.feature_points), 2), np.nan)
    for column, eye in enumerate(EYES):
        own = [lid for lid in lids if lid.eye == eye]
        if own:
            along = np.concatenate([lid.closing for lid in own])
            for frames in frame_blocks(len(motion)):
                at = solution.displaced(frames)
                moved = [at[:, lid.marker] - lid.skin(at) for lid in own]
                motion[frames, column] = np.concatenate(moved, axis=1) @ along / (along**2).sum()
    return motion
