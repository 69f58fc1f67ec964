"""Head space of a filmed face, aligned with the character in space.

In the image of a face at rest other proportions look like a turn: the neutral of a stylised head
fits a person's best when it is tilted by 20 degrees. Once parallax shows the performer's own face,
the two are aligned in space.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.geometry.rigid_fit import Pose
from usdface.geometry.rigid_modes import infinitesimal_motions

__all__ = ["aligned_head"]

# Gauss-Newton steps, and the least one, of an angle [rad] and a length [m], at which they end.
_STEPS = 10
_SETTLED = 1e-9


def aligned_head(
    rest_pose: Pose, pose: Pose, rest: FloatArray, face: FloatArray, deviation: float
) -> tuple[Pose, Pose, FloatArray]:
    """Return poses and resting markers in a head space in which these lie on the character.

    The camera sees the same: a face twice as large is twice as far away. Depths count less than
    the two other axes as far as they are less certain.

    Parameters
    ----------
    rest_pose, pose : Pose
        Of the neutral, one frame, and of all frames, in camera space.
    rest : (M, 3) float64 [m]
        The markers at rest, in head space.
    face : (M, 3) float64 [m]
        On the character.
    deviation : float [m]
        Standard deviation of a depth of `rest`.
    """
    turn, size, shift = np.eye(3), 1.0, np.zeros(3)
    placed = rest
    for _ in range(_STEPS):
        centre = placed.mean(axis=0)
        step = _similarity_step(placed - centre, face - placed, deviation)
        grown = np.exp(step[6]) * Rotation.from_rotvec(step[3:6]).as_matrix()
        turn, size = Rotation.from_rotvec(step[3:6]).as_matrix() @ turn, np.exp(step[6]) * size
        shift = grown @ (shift - centre) + centre + step[:3]
        placed = size * rest @ turn.T + shift
        if np.abs(step).max() < _SETTLED:
            break

    def before_camera(before: Pose) -> Pose:
        rotations = before.rotations @ turn.T
        return Pose(rotations, size * before.translations - rotations @ shift)

    return before_camera(rest_pose), before_camera(pose), placed


def _similarity_step(points: FloatArray, off: FloatArray, deviation: float) -> FloatArray:
    """Return the translation, rotation and growth (7,) that takes most of `off` (M, 3) away.

    `points` (M, 3) are centred. The faces differ along each axis alike; depths also by their
    deviation.
    """
    squares = (off**2).mean(axis=0) - [0.0, 0.0, deviation**2]
    apart = squares.clip(min=0.0).mean()
    share = np.array([1.0, 1.0, np.sqrt(apart / max(apart + deviation**2, 1e-300))])
    columns = np.concatenate([infinitesimal_motions(points), points[None]]) * share
    step, *_ = np.linalg.lstsq(columns.reshape(7, -1).T, (off * share).ravel(), rcond=None)
    return np.asarray(step)
