"""Linear estimate of how far the lids are closed, from the markers and all of a rig's blend shapes.

A blink, a squint and a glance down move the markers near an eye in much the same way, but close it
by different amounts. The best linear estimate of the opening between the lids
(Gauss and Markov; C. R. Rao, "Linear Statistical Inference and Its Applications", 1973) weighs the
markers so that each blend shape counts by the share of the opening that it closes.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.closure.closing_displacements import (
    closing_displacements,
    near_lids,
    scanned_glance_displacements,
    scanned_lid_displacements,
)
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.face.bound_face import BoundFace
from usdface.numerics.frame_blocks import frame_blocks
from usdface.retarget.solution import Solution

__all__ = ["LidEstimate", "lid_estimate"]

# Standard deviations of the weights around rest: of the shapes that close an eye, and all others.
_CLOSER, _OTHERS = 1.0, 0.3
# Of the opening that a glance down takes where the rig does not say: that of the ICT face.
_GLANCE = 0.47
# Least misfit of a rig's blend shapes to a human face [m].
_MISFIT = 3e-4


class LidEstimate(NamedTuple):
    """How much of each eye's opening is gone: (F, 2), 1 closed; NaN without markers there.

    And the standard deviation of each that the markers leave: (2,).
    """

    gone: FloatArray
    deviation: FloatArray


def lid_estimate(
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures],
    names: tuple[str, ...],
    solution: Solution,
) -> LidEstimate:
    """Return how much of each eye's opening is gone.

    A glance down lowers the lids, too: as on a scanned face, if not on the rig.

    Parameters
    ----------
    face : BoundFace
    by_eye : mapping of "left", "right" to LidApertures
    names : tuple of str, length T
        The blend shapes that `by_eye` is of.
    solution : Solution
    """
    frames = len(solution.feature_points)
    estimate = LidEstimate(np.full((frames, 2), np.nan), np.full(2, np.nan))
    near = {
        eye: near_lids(
            face, apertures, closing_displacements(face, apertures, names, solution.markers)
        )
        for eye, apertures in by_eye.items()
    }
    measured = [eye for eye in by_eye if near[eye].any()]
    if not measured:
        return estimate
    order = [face.markers.index(name) for name in solution.markers]
    column = {name: place for place, name in enumerate(face.shape_names)}
    known = np.array([name in column for name in names])
    offsets = np.zeros((len(names), len(face.markers), 3))
    offsets[known] = face.offsets[[column[name] for name in names if name in column]]
    scanned = [scanned_lid_displacements(face, by_eye[eye], names) for eye in measured]
    offsets[[shape for lids in scanned for shape in lids]] = 0.0
    for shape, moved_by_lid in (each for lids in scanned for each in lids.items()):
        offsets[shape] += moved_by_lid  # of both eyes, if one shape closes them
    deviations = np.full(len(names), _OTHERS)
    deviations[[by_eye[eye].closer for eye in measured]] = _CLOSER
    taken = np.array([_closed_by(by_eye[eye], len(names)) for eye in measured])
    for row, eye in enumerate(measured):
        glance = scanned_glance_displacements(face, by_eye[eye], names)
        if glance is not None:
            offsets = np.concatenate([offsets, glance[None]])
            deviations = np.append(deviations, _CLOSER)
            taken = np.c_[taken, _GLANCE * (np.arange(len(measured)) == row)]
    moved = deviations[:, None] * offsets[:, order].reshape(len(offsets), -1)
    lids = np.any([near[eye] for eye in measured], axis=0)
    unexplained = _unexplained(solution, face.size, lids)
    normal = moved @ moved.T + unexplained * np.eye(len(moved))
    by_weight = taken * deviations
    closed = by_weight @ np.linalg.solve(normal, moved)
    columns = [EYES.index(eye) for eye in measured]
    left = np.linalg.solve(normal, by_weight.T)
    estimate.deviation[columns] = np.sqrt(unexplained * np.einsum("et,te->e", by_weight, left))
    for block in frame_blocks(frames):
        at = solution.displaced(block)
        estimate.gone[block, columns] = at.reshape(len(at), -1) @ closed.T
    return estimate


def _unexplained(solution: Solution, size: float, lids: BoolArray) -> float:
    """Return the variance [m^2] of a coordinate of the markers that the blend shapes leave.

    Lids that move unlike the rig's may well be closed: their markers (M,) count, as uncertain ones.
    """
    variance = solution.noise**2 + max(solution.misfit, size * _MISFIT) ** 2
    if solution.errors is None:
        return variance
    return variance * float(np.mean(solution.errors[lids] ** 2))


def _closed_by(apertures: LidApertures, count: int) -> FloatArray:
    """Return by how much of the opening each shape brings the lids together: (T,)."""
    return np.asarray(1.0 - apertures.at(np.eye(count)).mean(axis=1) / apertures.neutral.mean())
