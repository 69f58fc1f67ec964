"""Deformed meshes as linear combinations of shapes, for the many frames of a take.

Where nothing but blend shapes moves a mesh, each of its points is the point at rest plus a
weighted sum of offsets. All frames are then one matrix product.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray

__all__ = ["LinearMorph", "normal_distances", "point_distances"]

_BLOCK = 2**22  # numbers of 32 bits at once

Parts = NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class LinearMorph:
    """A mesh at F moments: ``points + weights[f] @ moves``, normals likewise.

    Attributes
    ----------
    weights : (F, B) float64
    points : (N, 3) float64 [m]
    moves : (B, N, 3) float32 [m]
    normals, normal_moves : (N, 3) float64 and (B, N, 3) float32, or None
        Of any length.
    """

    weights: FloatArray
    points: FloatArray
    moves: Parts
    normals: FloatArray | None = None
    normal_moves: Parts | None = None

    def points_at(self, frame: int) -> FloatArray:
        """Return the points (N, 3) [m] of one frame."""
        return np.asarray(self.points + _weighted_sum(self.weights[frame], self.moves))

    def normals_at(self, frame: int) -> FloatArray | None:
        """Return unit normals (N, 3) of one frame."""
        if self.normals is None or self.normal_moves is None:
            return None
        shown = self.normals + _weighted_sum(self.weights[frame], self.normal_moves)
        length = np.linalg.norm(shown, axis=1, keepdims=True)
        return np.asarray(shown / np.where(length > 0, length, 1.0))


def point_distances(
    one: LinearMorph, other: LinearMorph, pairs: tuple[IntArray, IntArray], frames: IntArray
) -> Iterator[NDArray[np.float32]]:
    """Yield the distances [m] of paired vertices at `frames` (f,): (f, n) in blocks of pairs.

    Differences are taken before they are summed, so that 32 bits are enough.
    """
    mine, its = _used_shapes(one.weights[frames], other.weights[frames])
    weights = np.concatenate(
        [one.weights[frames][:, mine], -other.weights[frames][:, its]], 1
    ).astype(np.float32)
    for here, there in _blocks(pairs, len(frames)):
        rest = (one.points[here] - other.points[there]).astype(np.float32)
        moves = np.concatenate([one.moves[mine][:, here], other.moves[its][:, there]])
        yield _lengths(_deformed(weights, rest, moves))


def normal_distances(
    one: LinearMorph, other: LinearMorph, pairs: tuple[IntArray, IntArray], frames: IntArray
) -> Iterator[NDArray[np.float32]]:
    """Yield the chords between unit normals of paired vertices, as `point_distances`."""
    if (
        one.normals is None
        or other.normals is None
        or one.normal_moves is None
        or other.normal_moves is None
    ):
        return
    mine, its = _used_shapes(one.weights[frames], other.weights[frames])
    for here, there in _blocks(pairs, len(frames)):
        sides = []
        for side, used, at in ((one, mine, here), (other, its, there)):
            assert side.normals is not None and side.normal_moves is not None
            weights = side.weights[frames][:, used].astype(np.float32)
            rest = side.normals[at].astype(np.float32)
            shown = _deformed(weights, rest, side.normal_moves[used][:, at])
            length = _lengths(shown)[..., None]
            sides.append(np.asarray(shown / np.where(length > 0, length, 1), np.float32))
        yield _lengths(np.asarray(sides[0] - sides[1], np.float32))


def _weighted_sum(weights: FloatArray, moves: Parts) -> Parts:
    return np.asarray(np.tensordot(weights.astype(np.float32), moves, 1))


def _used_shapes(one: FloatArray, other: FloatArray) -> tuple[IntArray, IntArray]:
    return np.flatnonzero(one.any(axis=0)), np.flatnonzero(other.any(axis=0))


def _blocks(pairs: tuple[IntArray, IntArray], frames: int) -> Iterator[tuple[IntArray, IntArray]]:
    step = max(1, _BLOCK // (3 * max(frames, 1)))
    for start in range(0, len(pairs[0]), step):
        yield pairs[0][start : start + step], pairs[1][start : start + step]


def _deformed(weights: Parts, rest: Parts, moves: Parts) -> Parts:
    shown = (weights @ moves.reshape(len(moves), rest.size) + rest.ravel()).reshape(-1, *rest.shape)
    return np.asarray(shown, np.float32)


def _lengths(vectors: Parts) -> NDArray[np.float32]:
    return np.asarray(np.sqrt(np.einsum("fvk,fvk->fv", vectors, vectors)))
