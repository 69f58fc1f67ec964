"""Deformed meshes as linear combinations of shapes, for the many frames of a take.

Each point is the point at rest plus a weighted sum of offsets, which joints or one transform may
place. All frames are then one matrix product, and one transform for each frame and group of
vertices.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.vertex_offsets import VertexOffsets
from usdface.certificate.vertex_transforms import VertexTransforms, placed

__all__ = ["LinearMorph", "normal_distances", "point_distances"]

_BLOCK = 2**22  # numbers of 32 bits at once
_LARGE = 64  # vertices of a group that is placed by itself: one matrix for all of them

Parts = NDArray[np.float32]
Pairs = tuple[IntArray, IntArray]


@dataclass(frozen=True, eq=False, slots=True)
class LinearMorph:
    """A mesh at F moments: ``points + weights[f] @ moves``, placed by `motion`; normals likewise.

    Attributes
    ----------
    weights : (F, B) float64
    points : (N, 3) float64 [m]
    moves : VertexOffsets [m]
    normals, normal_moves : (N, 3) float64 and VertexOffsets, or None
        Of any length.
    motion : VertexTransforms or None
        None where nothing else moves the mesh.
    """

    weights: FloatArray
    points: FloatArray
    moves: VertexOffsets
    normals: FloatArray | None = None
    normal_moves: VertexOffsets | None = None
    motion: VertexTransforms | None = None

    def points_at(self, frame: int) -> FloatArray:
        """Return the points (N, 3) [m] of one frame."""
        shown = np.asarray(self.points + self.moves.summed(self.weights[frame : frame + 1])[0])
        if self.motion is None:
            return shown
        matrices = self.motion.of_points(np.array([frame]), self.motion.groups)
        return np.asarray(placed(matrices[..., :3], shown[None])[0] + matrices[0, ..., 3])

    def mixed(self, shares: FloatArray) -> FloatArray | None:
        """Return sums of all frames' points with shares (K, F): (K, N, 3) [m].

        None where vertices are placed by more than one transform.
        """
        weights = self.weights.astype(np.float64)
        if self.motion is None:
            whole = shares.sum(axis=1)[:, None, None] * self.points
            return np.asarray(whole + self.moves.summed(shares @ weights))
        if len(self.motion.weights) > 1:
            return None
        matrices = self.motion.of_points(np.arange(len(weights)), np.zeros(1, np.int64))[:, 0]
        whole = np.tensordot(shares, matrices, 1)
        parts = np.einsum("kf,fb,fij->kbij", shares, weights, matrices[..., :3], optimize=True)
        moved = np.stack([self.moves.transformed(part) for part in parts])
        at_rest = self.points @ whole[..., :3].swapaxes(1, 2) + whole[:, None, :, 3]
        return np.asarray(at_rest + moved)

    def normals_at(self, frame: int) -> FloatArray | None:
        """Return unit normals (N, 3) of one frame."""
        if self.normals is None or self.normal_moves is None:
            return None
        shown = self.normals + self.normal_moves.summed(self.weights[frame : frame + 1])[0]
        if self.motion is not None:
            matrices = self.motion.of_normals(np.array([frame]), self.motion.groups)
            shown = placed(matrices, shown[None])[0]
        length = np.linalg.norm(shown, axis=1, keepdims=True)
        return np.asarray(shown / np.where(length > 0, length, 1.0))


def point_distances(
    one: LinearMorph, other: LinearMorph, pairs: Pairs, frames: IntArray
) -> Iterator[NDArray[np.float32]]:
    """Yield the distances [m] of paired vertices at `frames` (f,): (f, n) in blocks of pairs.

    Of pairs that nothing moves there is one row for all frames. Differences are taken before they
    are summed and placed, so that 32 bits are enough: where A places p and C places q,
    Ap - Cq = A(p - q) + (A - C)q.
    """
    mine, its = _used_shapes(one.weights[frames], other.weights[frames])
    theirs = other.weights[frames][:, its].astype(np.float32)
    weights = np.concatenate([one.weights[frames][:, mine].astype(np.float32), -theirs], 1)
    for here, there in _blocks(one, other, pairs, len(frames)):
        rest = (one.points[here] - other.points[there]).astype(np.float32)
        moves = other.moves.at(its, there)
        both = np.concatenate([one.moves.at(mine, here), moves])
        if one.motion is None and other.motion is None and not both.any():
            yield _lengths(rest[None])
            continue
        apart = _deformed(weights, rest, both)
        if one.motion is not None or other.motion is not None:
            matrices = _transforms(one.motion, here, frames)
            off = (matrices - _transforms(other.motion, there, frames)).astype(np.float32)
            shown = _deformed(theirs, other.points[there].astype(np.float32), moves)
            apart = placed(matrices[..., :3].astype(np.float32), apart)
            apart = np.asarray(apart + placed(off[..., :3], shown) + off[..., 3], np.float32)
        yield _lengths(apart)


def normal_distances(
    one: LinearMorph, other: LinearMorph, pairs: Pairs, frames: IntArray
) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Yield the chords between unit normals of paired vertices, as `point_distances`.

    With them the lengths of the second normals, before they get unit length.
    """
    if (
        one.normals is None
        or other.normals is None
        or one.normal_moves is None
        or other.normal_moves is None
    ):
        return
    mine, its = _used_shapes(one.weights[frames], other.weights[frames])
    for here, there in _blocks(one, other, pairs, len(frames)):
        sides = []
        parts = one.normal_moves.at(mine, here), other.normal_moves.at(its, there)
        placed_by = one.motion, other.motion
        moved = parts[0].any() or parts[1].any() or any(m is not None for m in placed_by)
        at_once = frames if moved else frames[:1]
        for side, normals, used, at, moves in zip(
            (one, other),
            (one.normals, other.normals),
            (mine, its),
            (here, there),
            parts,
            strict=True,
        ):
            weights = side.weights[at_once][:, used].astype(np.float32)
            rest = normals[at].astype(np.float32)
            shown = _deformed(weights, rest, moves)
            if side.motion is not None:
                turns = side.motion.of_normals(frames, _one_or_each(side.motion.groups[at]))
                shown = placed(turns.astype(np.float32), shown)
            lengths = _lengths(shown)
            unit = shown / np.where(lengths > 0, lengths, 1)[..., None]
            sides.append(np.asarray(unit, np.float32))
        yield _lengths(np.asarray(sides[0] - sides[1], np.float32)), lengths


def _used_shapes(one: FloatArray, other: FloatArray) -> tuple[IntArray, IntArray]:
    return np.flatnonzero(one.any(axis=0)), np.flatnonzero(other.any(axis=0))


def _transforms(
    motion: VertexTransforms | None, vertices: IntArray, frames: IntArray
) -> FloatArray:
    """Return the transforms (f, n or 1, 3, 4) of vertices (n,)."""
    if motion is None:
        return np.eye(3, 4)[None, None]
    return motion.of_points(frames, _one_or_each(motion.groups[vertices]))


def _one_or_each(groups: IntArray) -> IntArray:
    return groups[:1] if (groups == groups[:1]).all() else groups


def _blocks(one: LinearMorph, other: LinearMorph, pairs: Pairs, frames: int) -> Iterator[Pairs]:
    """Yield parts of the pairs, those that the same shapes and joints move together."""
    step = max(1, _BLOCK // (3 * max(frames, 1)))
    group = np.zeros(len(pairs[0]), np.int64)
    for side, at in zip((one, other), pairs, strict=True):
        if side.motion is not None:
            group = group * len(side.motion.weights) + side.motion.groups[at]
    order = np.lexsort((one.moves.signatures()[pairs[0]], group))
    here, there, group = pairs[0][order], pairs[1][order], group[order]
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    counts = np.diff(np.append(starts, len(group)))
    for start, count in zip(starts[counts >= _LARGE], counts[counts >= _LARGE], strict=True):
        for first in range(start, start + count, step):
            part = slice(first, min(first + step, start + count))
            yield here[part], there[part]
    left = np.flatnonzero(np.repeat(counts < _LARGE, counts))
    step = max(1, step // 4)  # a matrix for each vertex and frame
    for first in range(0, len(left), step):
        rest = left[first : first + step]
        yield here[rest], there[rest]


def _deformed(weights: Parts, rest: Parts, moves: Parts) -> Parts:
    """Return ``rest + weights @ moves``: (f, n, 3), by the shapes that move any of the vertices."""
    active = np.flatnonzero(moves.any(axis=(1, 2)))
    if not len(active):
        return np.broadcast_to(rest, (len(weights), *rest.shape))
    moved = weights[:, active] @ moves[active].reshape(len(active), rest.size)
    return np.asarray((moved + rest.ravel()).reshape(-1, *rest.shape), np.float32)


def _lengths(vectors: Parts) -> NDArray[np.float32]:
    return np.asarray(np.sqrt(np.einsum("fvk,fvk->fv", vectors, vectors)))
