"""Matching of the vertices of two meshes that were split and welded in conversion."""

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
    from scipy.spatial import KDTree  # costs more to import than most conversions need

    # Of more than the candidates at one point, rounded alike, normals choose already here.
    rounded = rounding > 0
    tree = KDTree(_columns(among, wanted, size) if rounded else among.places)
    places = (_columns(wanted, among, size) if rounded else wanted.places)[left]
    if wanted.normals is None or among.normals is None or len(among.places) < 2:
        return np.asarray(tree.query(places)[1], np.int64)
    count = min(_CANDIDATES, len(among.places))
    away, candidates = tree.query(places, k=count)
    if rounded:
        apart = among.places[candidates] - wanted.places[left, None]
        away = np.linalg.norm(apart, axis=-1)
    turned = np.linalg.norm(among.normals[candidates] - wanted.normals[left, None], axis=-1)
    nearest = away.min(axis=1, keepdims=True)
    turned[away > np.maximum(2 * nearest + _CLOSE * size, rounding)] = np.inf
    best = turned.argmin(axis=1)
    return np.asarray(candidates[np.arange(len(left)), best], np.int64)
