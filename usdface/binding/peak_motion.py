"""The motion of a rig in the peak frames, for markers at given vertices."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.binding.candidates import CandidateVertices
from usdface.binding.registration import MOTION_ERROR, Registration, trust_of
from usdface.geometry.rigid_modes import infinitesimal_motions, small_motions
from usdface.retarget.solver.bounded_least_squares import solve_bounded

__all__ = ["Targets", "peak_motion", "targets_of", "unexplained_motion"]

WeightBounds = Literal["solved", "clipped", "none"]

# Prior deviation of the weights is about 0.4: keeps hardly determined shapes at 0.
_WEIGHT_PRIOR = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class Targets:
    """Assigned markers: their points (M, 3), blend shape offsets (S, M, A) and trust (M,).

    Of an image A is 2: motion along the view is not seen.
    """

    points: FloatArray
    offsets: FloatArray
    trust: FloatArray

    @property
    def rigid(self) -> FloatArray:
        """Small motions of the head: (6, M, A)."""
        if self.offsets.shape[2] == 3:
            return infinitesimal_motions(self.points)
        return small_motions(self.points, image=True)[..., :2]


def targets_of(candidates: CandidateVertices, registration: Registration) -> Targets:
    """Return the markers where a registration has them, trusted by how well they fit there."""
    return Targets(
        candidates.points[registration.assigned],
        candidates.offsets[:, registration.assigned],
        trust_of(registration.marker_costs),
    )


def unexplained_motion(
    targets: Targets,
    moves: FloatArray,
    visible: BoolArray,
    *,
    start: Registration,
    size: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the mean squared motion of the markers that the rig cannot explain, in each frame.

    In units of the expected squared error: with unbounded weights (K,), and the increase with
    weights from 0 to 1 (K,). The first is the difference of the two faces, which grows with the
    distance from the neutral. The second reveals a false neutral, such as an open mouth: motion
    towards the true one needs negative weights.

    Parameters
    ----------
    targets : Targets
        Where the markers sit.
    moves : (K, M, A) float64 [m]
        Displacements from the neutral, in the character's space.
    visible : (K, M) bool
    start : Registration
        Its weights and rigid motions, of the K frames, predict occluded markers.
    size : float [m]
        Of the character's face: errors are shares of it.
    """

    def left(bounds: WeightBounds) -> FloatArray:
        weights, rigid = peak_motion(targets, moves, visible, start=start, bounds=bounds)
        predicted = weights @ targets.offsets.reshape(len(targets.offsets), -1)
        predicted += rigid @ targets.rigid.reshape(6, -1)
        squared = ((moves - predicted.reshape(moves.shape)) ** 2).sum(axis=2) * visible
        each = squared.sum(axis=1) / np.maximum(visible.sum(axis=1), 1)
        return np.asarray(each / (MOTION_ERROR * size) ** 2)

    signed = left("none")
    return signed, left("solved") - signed


def peak_motion(
    targets: Targets,
    moves: FloatArray,
    visible: BoolArray,
    *,
    start: Registration,
    bounds: WeightBounds,
) -> tuple[FloatArray, FloatArray]:
    """Solve weights (K, S) and small rigid motions (K, 6) of the peak frames for given vertices.

    `moves` (K, M, A) are in the character's space; where not `visible` the prediction of `start`
    stands in. The weights' bounds are "solved" with, "clipped" to afterwards, or there are "none".
    """
    count, root = len(moves), np.sqrt(targets.trust)[:, None]
    shapes = (targets.offsets * root).reshape(len(targets.offsets), -1)
    rigid = (targets.rigid * root).reshape(6, -1)
    predicted = start.weights @ shapes + start.rigid @ rigid
    observed = np.where(
        np.repeat(visible, moves.shape[2], axis=1), (moves * root).reshape(count, -1), predicted
    )
    columns = np.linalg.qr(rigid.T)[0]
    free = shapes - (shapes @ columns) @ columns.T
    normal = free @ free.T
    unit = float(np.abs(targets.points).max())
    ridge = _WEIGHT_PRIOR * len(targets.points) * (MOTION_ERROR * unit) ** 2
    normal += (ridge + 1e-9 * np.trace(normal) / len(normal)) * np.eye(len(normal))
    right = observed @ free.T
    if bounds == "solved":
        weights = solve_bounded(normal, right)
    else:
        weights = np.linalg.solve(normal, right.T).T
        weights = weights.clip(0.0, 1.0) if bounds == "clipped" else weights
    motions = np.linalg.lstsq(rigid.T, (observed - weights @ shapes).T, rcond=None)[0].T
    return np.asarray(weights), np.asarray(motions)
