"""Matching of the vertices of two meshes that were split and welded in conversion."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray

__all__ = ["VertexTraits", "match_vertices"]

_SAME = 1e-6  # of the size: 8 roundings of float32
_CLOSE = 2e-5  # of the size: within it normals decide; 20 times _SAME
_NORMAL = 1e-3  # of the size: weight of a normal against a place
_CANDIDATES = 8  # vertices at one point, split by their normals and texture coordinates


@dataclass(frozen=True, eq=False, slots=True)
class VertexTraits:
    """Features of vertices: `places` (N, K) [m] in several poses, `normals` (N, 3)."""

    places: FloatArray
    normals: FloatArray | None = None


def match_vertices(
    one: VertexTraits, other: VertexTraits, rounding: float = 0.0
) -> tuple[IntArray, IntArray]:
    """Return pairs of vertices (P,), (P,): for each of a side the most alike of the other side.

    Alike in place; of those that are equally near within rounding, in normal. `rounding` [m] is
    that of places (K,) beyond float32.
    """
    pairs = np.concatenate(
        [
            np.stack([np.arange(len(one.places)), _nearest_vertices(one, other, rounding)], 1),
            np.stack([_nearest_vertices(other, one, rounding), np.arange(len(other.places))], 1),
        ]
    )
    # A number of 64 bits sorts faster than a pair.
    joined = np.unique(pairs[:, 0] * max(len(other.places), 1) + pairs[:, 1])
    return joined // max(len(other.places), 1), joined % max(len(other.places), 1)


def _nearest_vertices(wanted: VertexTraits, among: VertexTraits, rounding: float) -> IntArray:
    """Return for each vertex of `wanted` the one `among`."""
    size = max(float(np.ptp(wanted.places[:, :3], axis=0).max(initial=0.0)), 1e-30)
    found, sure = _search_sorted(_columns(wanted, among, size), _columns(among, wanted, size), size)
    left = np.flatnonzero(~sure)
    if len(left):
        found[left] = _search_tree(wanted, among, left, size, rounding)
    return found


def _columns(own: VertexTraits, facing: VertexTraits, size: float) -> FloatArray:
    if own.normals is None or facing.normals is None:
        return own.places
    return np.concatenate([own.places, _NORMAL * size * own.normals], 1)


def _search_sorted(
    wanted: FloatArray, among: FloatArray, size: float
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Search near each of `wanted` `among` the others, in their order along some direction."""
    direction = np.random.default_rng(1).normal(size=wanted.shape[1])
    along = among @ direction
    order = np.argsort(along)
    place = np.searchsorted(along[order], wanted @ direction)
    found = np.zeros(len(wanted), np.int64)
    sure = np.zeros(len(wanted), bool)
    left = np.arange(len(wanted))
    for shift in (0, -1, 1, -2, 2, -3):
        beside = order[(place[left] + shift).clip(0, len(order) - 1)]
        alike = np.abs(wanted[left] - among[beside]).max(axis=1) <= _SAME * size
        found[left[alike]], sure[left[alike]] = beside[alike], True
        left = left[~alike]
    return found, sure


def _search_tree(
    wanted: VertexTraits, among: VertexTraits, left: IntArray, size: float, rounding: float
) -> IntArray:
    if wanted.normals is None or among.normals is None or len(among.places) < 2:
        from scipy.spatial import KDTree  # costs more to import than most conversions need

        return np.asarray(KDTree(among.places).query(wanted.places[left])[1], np.int64)
    # Of more than the candidates at one point normals choose already in the search.
    if rounding > 0:
        return _nearest_alike(wanted, among, left, _columns, size, rounding)[0]
    found, crowded = _nearest_alike(wanted, among, left, _places, size, rounding)
    if crowded.any():
        found[crowded] = _nearest_alike(wanted, among, left[crowded], _columns, size, rounding)[0]
    return found


def _places(own: VertexTraits, _facing: VertexTraits, _size: float) -> FloatArray:
    return own.places


def _nearest_alike(
    wanted: VertexTraits,
    among: VertexTraits,
    left: IntArray,
    columns: Callable[[VertexTraits, VertexTraits, float], FloatArray],
    size: float,
    rounding: float,
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Return of the candidates by `columns` the one whose normal is most alike.

    And whether all candidates are at one point, where there may be more of them.
    """
    from scipy.spatial import KDTree

    assert wanted.normals is not None and among.normals is not None
    count = min(_CANDIDATES, len(among.places))
    tree = KDTree(columns(among, wanted, size))
    candidates = tree.query(columns(wanted, among, size)[left], k=count)[1]
    away = np.linalg.norm(among.places[candidates] - wanted.places[left, None], axis=-1)
    turned = np.linalg.norm(among.normals[candidates] - wanted.normals[left, None], axis=-1)
    limit = np.maximum(2 * away.min(axis=1, keepdims=True) + _CLOSE * size, rounding)
    turned[away > limit] = np.inf
    best = candidates[np.arange(len(left)), turned.argmin(axis=1)]
    return np.asarray(best, np.int64), (away <= limit).all(axis=1) & (count < len(among.places))
