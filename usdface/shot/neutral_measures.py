"""The measures of a verdict about the neutral frames of a shot."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.neutral_weights import LARGEST, weights_at_limit
from usdface.retarget.solution import Solution
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.shot import Shot
from usdface.verdict.judge import Measured

__all__ = ["neutral_at_limit", "neutral_expressive"]

_NAMED = 4  # blend shapes that a reason names
# Ridge of the unbounded least squares, as a share of the mean energy of a shape. Set by hand.
_RIDGE = 0.02


def neutral_expressive(shot: Shot, solution: Solution, motion: float) -> Measured:
    """Measure motion on the opposite side of the neutral, which a false neutral causes.

    Where a shape is open in the neutral, the take needs its weight below 0 whenever it closes:
    least squares without bounds show by how much, in half of the frames. Where the solve has
    corrected the neutral, the neutral frames are away from it, by more than the weights that they
    show.

    Parameters
    ----------
    shot : Shot
    solution : Solution
    motion : float [m]
        RMS displacement of the markers, above 0.

    Returns
    -------
    Measured
        As a share of `motion`; NaN where no neutral is named or found, where the take has no other
        frames, and where no blend shape moves a marker.
    """
    neutral, face = shot.setup.neutral, shot.face
    shapes = face.mesh.offsets_at(face.vertices_of(solution.markers))
    flat = shapes.reshape(len(shapes), -1)
    gram = flat @ flat.T
    if neutral is None or neutral[1] - neutral[0] + 1 >= len(solution.residual) or not gram.any():
        return Measured(np.nan)
    away = solution.displaced(slice(neutral[0], neutral[1] + 1)).mean(axis=0)
    away = away - _shown(solution, face)
    corrected = float(np.sqrt((away**2).sum(axis=1).mean()))
    held = gram + _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    free = by_blocks(
        len(solution.residual), lambda frames: _free(held, flat, solution.displaced(frames))
    )
    below = -np.median(free, axis=0) * np.sqrt(np.diag(gram) / len(solution.markers))
    most = np.argsort(-below, kind="stable")[:_NAMED].tolist()
    return Measured(
        max(corrected, float(below.max())) / motion,
        "shapes",
        tuple(face.shape_names[shape] for shape in most),
        neutral,
        tuple(shot.take.times[list(neutral)].tolist()),
    )


def _shown(solution: Solution, face: BoundFace) -> FloatArray:
    """Return the displacements (M, 3) of the weights that the neutral frames show."""
    shown = solution.neutral_weights
    weights = np.array([[shown.get(name, 0.0) for name in face.shape_names]])
    places = [face.markers.index(name) for name in solution.markers]
    return np.asarray(face.displacements(weights)[0, places])


def _free(held: FloatArray, flat: FloatArray, moved: FloatArray) -> FloatArray:
    """Return the weights (F, S) without bounds of displacements (F, M, 3)."""
    return np.asarray(np.linalg.solve(held, flat @ moved.reshape(len(moved), -1).T).T)


def neutral_at_limit(setup: RetargetSetup, solution: Solution, face: BoundFace) -> Measured:
    """Measure weights of the neutral at the limit of their estimate: more of them may show.

    NaN where a person names the weights, which may be larger, and are all that shows.
    """
    cut = weights_at_limit(solution.neutral_weights, face.evaluator, face.shape_names)
    if setup.neutral is None or setup.neutral_weights or not cut:
        return Measured(np.nan)
    return Measured(LARGEST, "shapes", cut[:_NAMED], setup.neutral)
