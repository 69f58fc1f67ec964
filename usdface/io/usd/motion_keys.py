"""Keys between which a motion is lines and arcs, as UsdSkel's joints and glTF's nodes go.

A stage turns by Euler angles about pivots, through parents that move as well: between two of its
samples a prim goes along curves that no pair of translation and quaternion follows.
"""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray
from usdface.io.transforms import along, compose, decompose

__all__ = ["continuous_parts", "motion_keys"]

_TOLERANCE = 1e-5  # of a component of a matrix, of the way that a point at distance 1 goes
_DEEPEST = 9  # halvings of the time between two samples

Parts = tuple[FloatArray, FloatArray, FloatArray]


def continuous_parts(matrices: FloatArray) -> Parts:
    """Return translations (F, 3), rotations (F, 4) and scales (F, 3) of matrices (F, 4, 4) in time.

    A decomposition is ambiguous, as mirroring two axes is a rotation: each frame has the one whose
    rotation is nearest to that before. A matrix with a scale of 0 keeps its rotation.
    """
    moves, turns, sizes = decompose(matrices)
    flat = np.abs(np.linalg.det(matrices[:, :3, :3])) <= np.finfo(float).tiny
    for k in range(1, len(turns)):
        if flat[k]:
            axes = compose(np.zeros(3), turns[k - 1], np.ones(3))[:3, :3]
            signs = np.sign((matrices[k, :3, :3] * axes).sum(axis=1))
            turns[k] = decompose(_completed(matrices[k], signs, axes))[1]
            axes = compose(np.zeros(3), turns[k], np.ones(3))[:3, :3]
            sizes[k] = (matrices[k, :3, :3] * axes).sum(axis=1)
            continue
        turned = np.array([_times(axis, turns[k]) for axis in np.eye(4)])  # half turns; w is none
        best = int(np.abs(turned @ turns[k - 1]).argmax())
        if np.abs(turned[best] @ turns[k - 1]) > np.abs(turned[3] @ turns[k - 1]) + 1e-6:
            turns[k] = turned[best]
            sizes[k] = sizes[k] * np.where(np.arange(3) == best, 1.0, -1.0)
    return moves, turns, sizes


def _completed(matrix: FloatArray, signs: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the rotation (4, 4) of a matrix that a scale flattens, near the rotation `axes`."""
    length = np.linalg.norm(matrix[:3, :3], axis=1)
    lost = np.flatnonzero(length <= _TOLERANCE * length.max())
    result = np.eye(4)
    result[:3, :3] = axes
    if len(lost) == 1:
        (k,) = lost
        near, far = (k + 1) % 3, (k + 2) % 3
        for row in (near, far):
            result[row, :3] = signs[row] * matrix[row, :3] / length[row]
        result[k, :3] = np.cross(result[near, :3], result[far, :3])
    return result


def _times(half: FloatArray, turn: FloatArray) -> FloatArray:
    """Return the quaternion that turns by `half` in the frame of `turn`, and then by that."""
    x, y, z, w = turn
    a, b, c, d = half
    return np.array(
        [
            w * a + x * d + y * c - z * b,
            w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d,
            w * d - x * a - y * b - z * c,
        ]
    )


def motion_keys(matrix_at: Callable[[float], FloatArray], codes: FloatArray) -> FloatArray:
    """Return `codes` (F,) and those between that `matrix_at` (4, 4) needs to be followed.

    Between two samples the time is halved until lines and arcs are within 1e-5, at most nine times.
    """
    known = {code: matrix_at(code) for code in codes.tolist()}
    spans = list(zip(codes[:-1].tolist(), codes[1:].tolist(), strict=True))
    for _ in range(_DEEPEST):
        wrong = []
        for start, stop in spans:
            # A third and a half: an odd motion is right in the middle by chance.
            moments = [start + part * (stop - start) for part in (1 / 3, 0.5)]
            known |= {code: matrix_at(code) for code in moments[1:]}
            shown = np.array([known[start], matrix_at(moments[0]), known[moments[1]], known[stop]])
            if _interpolation_error(shown, np.array([1 / 3, 0.5])) > _TOLERANCE:
                wrong += [(start, moments[1]), (moments[1], stop)]
            else:
                del known[moments[1]]
        if not wrong:
            break
        spans = wrong
    return np.array(sorted(known))


def _interpolation_error(shown: FloatArray, parts: FloatArray) -> float:
    """Return the error of linear interpolation from first to last, shear ignored."""
    # The two alone, as they will follow each other as keys: a turn by more than a right angle
    # between them is taken for a mirroring of two axes.
    moves, turns, sizes = continuous_parts(shown[[0, -1]])
    share = parts[:, None]
    between = compose(
        (1 - share) * moves[0] + share * moves[1],
        along(turns, np.zeros(len(parts), np.int64), parts),
        (1 - share) * sizes[0] + share * sizes[1],
    )
    meant = compose(*decompose(shown[1:-1]))
    return float(np.abs(between - meant).max() / max(1.0, np.abs(moves).max()))
