"""Pairs of vertices of two evaluations of one mesh: which of them are the same."""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.evaluated_mesh import EvaluatedMesh
from usdface.certificate.linear_morph import LinearMorph
from usdface.certificate.vertex_matching import VertexTraits, match_vertices

__all__ = ["blocks", "vertex_pairs"]

_BLOCK = 2**19  # numbers of one evaluation at once


def vertex_pairs(
    one: EvaluatedMesh,
    other: EvaluatedMesh,
    frames: IntArray,
    sums: tuple[LinearMorph, LinearMorph] | None,
) -> tuple[IntArray, IntArray]:
    """Return pairs of vertices that move alike.

    They are distinguished at the first of `frames` and in weighted sums of all frames; where these
    are expensive, of the frames in which some channel is strongest.
    """
    chosen, shares = frames, _shares(len(frames))
    mixtures = _summed_mixtures(*sums, shares) if sums is not None else None
    if mixtures is None:
        strongest = np.abs(one.weights[frames]).argmax(axis=0) if one.weights.size else []
        chosen = frames[np.unique(np.concatenate([[0], strongest]).astype(np.int64))]
        shares = _shares(len(chosen))
        mixtures = (
            _evaluated_mixture(one, chosen, shares),
            _evaluated_mixture(other, chosen, shares),
        )
    rounding = 0.0
    if other.steps is not None:
        sides = [other.steps.of_mixture(share, chosen) for share in shares]
        rounding = float(np.linalg.norm([*other.steps.of_points(frames[:1]), *sides]))

    def traits(mesh: EvaluatedMesh, mixed: FloatArray) -> VertexTraits:
        normals = mesh.normals_at(frames[:1])
        places = np.concatenate([mesh.points_at(frames[:1])[0], *mixed], 1)
        return VertexTraits(places, None if normals is None else normals[0])

    return match_vertices(traits(one, mixtures[0]), traits(other, mixtures[1]), rounding)


def _summed_mixtures(
    one: LinearMorph, other: LinearMorph, shares: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return mixtures (K, N, 3) of all frames of both; None where one side has no sums of them."""
    mine, its = one.mixed(shares), other.mixed(shares)
    return None if mine is None or its is None else (mine, its)


def _evaluated_mixture(mesh: EvaluatedMesh, frames: IntArray, shares: FloatArray) -> FloatArray:
    """Return mixtures (K, N, 3) of frames (f,) with shares (K, f)."""
    count = mesh.points_at(frames[:1])[0].size // 3
    total = np.zeros((len(shares), count, 3))
    for block in blocks(len(frames), 3 * count):
        total += np.tensordot(shares[:, block], mesh.points_at(frames[block]), 1)
    return total


def _shares(frames: int) -> FloatArray:
    """Return the shares of frames in three mixtures."""
    return np.asarray(np.random.default_rng(0).normal(size=(3, frames)) / np.sqrt(frames))


def blocks(frames: int, numbers: int) -> list[slice]:
    """Return slices of `frames` of which each has so many numbers, as many as memory allows."""
    step = max(1, _BLOCK // max(numbers, 1))
    return [slice(start, start + step) for start in range(0, frames, step)]
