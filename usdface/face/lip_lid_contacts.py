"""Contacts of lips and lids, found on the mesh and the blend shapes of a rig.

Two vertices of one skin that face each other across a gap are a pair. Lips are pairs that are
close on the neutral face and that some blend shape parts by several times their distance, more
than skin stretches. Those of a mouth that rests open are found where the shape that opens it would
close it, played backwards. Lids are pairs with a gap that some blend shape closes which does not
move the lips.
"""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from usdface.arrays import BoolArray, FloatArray, IntArray, frozen
from usdface.geometry.face_corners import next_corners
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.stray_points import stray_points
from usdface.geometry.vertex_normals import vertex_normals
from usdface.rigs import BlendShape, Mesh
from usdface.rigs.face_mesh import largest_offsets
from usdface.rigs.once_per_mesh import once_per_mesh

__all__ = ["LipLidContacts", "find_lip_lid_contacts", "widest_pair"]

# In spreads of the moving skin (54 to 74 mm). Pairs found on the faces of ICT, MakeHuman and the
# example: resting lips are up to 0.023, 0.059 and 0.057 apart and drawn apart by at least 0.12,
# 0.06 and 0.15; open lids are 0.05 to 0.15, 0.06 to 0.17 and 0.07 to 0.35 apart.
_CLOSE = 0.06
_DRAWN_APART = 0.06
_LID_GAP = (0.05, 0.35)
# A vertex that moves by less, half a millimetre, counts as still.
_STILL = 0.01
# Lips: drawn apart by this much of their distance (skin stretches less; the three faces: by 14, 3.9
# and 3.4). Lids: brought together to this part of it (down to 0.27, 0.26 and 0.29).
_TIMES = 3.0
_CLOSED = 0.3
# Cosine between a normal and the way to the partner: within 78 degrees of it.
_FACING = 0.2
# Nearest vertices among which a partner is searched: bounds time and memory on dense meshes.
_NEIGHBOURS = 24
# A seam of an open mouth has a pair so near to the middle of the face, in spreads; no eye has: the
# innermost lids of ICT, MakeHuman and the example are 0.29, 0.36 and 0.24 away.
_MIDDLE = 0.1
# Pairs of one gap are so near to the next one, in spreads; an eye is farther from the mouth. Set by
# hand.
_APART = 0.2
# Fewer pairs are a fold of the skin.
_LEAST_LIDS = 4
# How far the shape that lowers the face most is played backwards for the lips of a mouth that rests
# open to meet: they do at 1/9 where it shows 0.1 of that shape at rest, at 1 where it shows a half.
_BACKWARDS = (0.1, 0.15, 0.22, 0.33, 0.5, 0.75, 1.1)
# A piece of the mesh with fewer vertices, as a share of the largest that moves, is no skin: lashes,
# tear film and shadow meshes of an eye close with it (ICT: 204 of 14,062 vertices and fewer).
_SKIN_SHARE = 0.1


_NONE: IntArray = frozen(np.zeros((0, 2)), np.int64)


class LipLidContacts(NamedTuple):
    """Pairs of vertices, upper and lower: (P, 2) int64 each.

    `open_lips` are those of a mouth that rests open, along all of it; they do not touch.
    """

    lips: IntArray
    lids: IntArray
    open_lips: IntArray = _NONE

    @property
    def mouth(self) -> IntArray:
        """Pairs (P, 2) of lips along the mouth, whether it rests open or closed."""
        return self.open_lips if len(self.open_lips) else self.lips

    def lids_of_eye(self, points: FloatArray, side: int, middle: float) -> IntArray:
        """Return the lid pairs (P, 2) of the left (1) or right (-1) eye.

        `points` (V, 3) are those of the mesh, `middle` [m] is x of the midline.
        """
        across = points[self.lids, 0].mean(axis=1) - middle
        return np.asarray(self.lids[side * across > 0.0])


class _Skin(NamedTuple):
    points: FloatArray
    normals: FloatArray
    piece: IntArray
    large: BoolArray
    spread: float


@once_per_mesh
def find_lip_lid_contacts(mesh: Mesh) -> LipLidContacts:
    """Find the pairs of vertices that touch where the mouth or an eye is closed.

    Without lips if the neutral mouth is open, without lids if no blend shape closes the eyes.
    """
    return LipLidContacts(*(frozen(pairs, np.int64) for pairs in _find(mesh)))


def widest_pair(points: FloatArray, pairs: IntArray) -> IntArray:
    """Return the pair of `pairs` (P, 2) with the greatest difference of height: (2,)."""
    return np.asarray(pairs[(points[pairs[:, 0], 1] - points[pairs[:, 1], 1]).argmax()])


def _find(mesh: Mesh) -> LipLidContacts:
    reach = largest_offsets(mesh)
    moving = np.flatnonzero(reach > 0)
    if len(moving) < 2:
        return LipLidContacts(_NONE, _NONE)
    skin = _skin(mesh, moving)
    middle = float(np.median(skin.points[moving, 0]))
    far = np.flatnonzero((reach > _STILL * skin.spread) & skin.large)
    lips = _lips(mesh, skin, far)
    closes = _in_middle(skin.points[lips].mean(axis=1), middle, skin).any()
    open_lips = _NONE if closes else _open_lips(mesh, skin, far, middle)
    closed = cache(lambda k: _closed_by(mesh.shapes[k], skin))
    mouth = np.concatenate([lips, open_lips])
    if not len(mouth):
        mouth = _closed_gaps(map(closed, range(len(mesh.shapes))), skin, middle)
    apart = np.flatnonzero(~_moves_any(mesh, mouth, moving, _STILL * skin.spread)).tolist()
    lids = [pairs for k in apart if len(pairs := closed(k)) >= _LEAST_LIDS]
    # If several blend shapes close an eye, the first one decides on the partner of a vertex.
    all_lids = np.concatenate([_NONE, *lids])
    first = np.unique(all_lids[:, 0], return_index=True)[1]
    found = lips, all_lids[np.sort(first)], open_lips
    return LipLidContacts(*(_upper_first(pairs, skin) for pairs in found))


def _skin(mesh: Mesh, moving: IntArray) -> _Skin:
    count = len(mesh.points)
    corners = mesh.face_indices
    following = corners[next_corners(mesh.face_counts)]
    normals = vertex_normals(mesh.points, mesh.face_counts, corners)
    edges = coo_matrix((np.ones(len(corners)), (corners, following)), shape=(count, count))
    piece = connected_components(edges, directed=False)[1]
    sizes = np.bincount(piece)[piece]
    large = sizes >= _SKIN_SHARE * sizes[moving].max()
    moved = mesh.points[moving]
    spread = rms_radius(moved[~stray_points(moved)])
    return _Skin(mesh.points, normals, piece, large, spread)


def _in_middle(at: FloatArray, middle: float, skin: _Skin) -> BoolArray:
    """Return which points (N, 3) are near to the middle of the face, which is at x = `middle`."""
    return np.asarray(np.abs(at[:, 0] - middle) < _MIDDLE * skin.spread)


def _open_lips(mesh: Mesh, skin: _Skin, moving: IntArray, middle: float) -> IntArray:
    """Return the pairs (P, 2) of lips that meet where the shape that opens them plays backwards."""

    def lowering(shape: BlendShape) -> float:
        down = shape.offsets[skin.large[shape.indices], 1].clip(max=0.0)
        return float((down**2).sum())

    opening = max(mesh.shapes, key=lowering)
    near = moving[_in_middle(skin.points[moving], middle, skin)]
    found = _NONE
    for weight in _BACKWARDS:
        at = skin.points.copy()
        at[opening.indices] -= weight * opening.offsets
        back = skin._replace(points=at)
        if len(found) or len(_lips(mesh, back, near)):
            pairs = _lips(mesh, back, moving)
            if len(pairs) <= len(found):
                break
            found = pairs
    return found if len(found) >= _LEAST_LIDS else _NONE


def _closed_gaps(closed: Iterable[IntArray], skin: _Skin, middle: float) -> IntArray:
    """Return the pairs (P, 2) of gaps across the middle of the face, of those that shapes close."""
    found = [_NONE]
    for pairs in closed:
        at = skin.points[pairs].mean(axis=1)
        near = _in_middle(at, middle, skin)
        if near.any():  # a shape may close the eyes, too
            gap = _gaps(at, _APART * skin.spread)
            found.append(pairs[np.isin(gap, gap[near])])
    return np.concatenate(found)


def _gaps(at: FloatArray, reach: float) -> IntArray:
    """Return the gap of each place (P, 3): places within `reach` of one another are of one."""
    a, b = cKDTree(at).query_pairs(reach, output_type="ndarray").T
    near = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(at), len(at)))
    return np.asarray(connected_components(near, directed=False)[1], dtype=np.int64)


def _moves_any(mesh: Mesh, pairs: IntArray, moving: IntArray, least: float) -> BoolArray:
    """Return which shapes move any vertex of some pairs by `least`, also less their drift: (S,)."""
    own = mesh.offsets_at(np.unique(pairs))
    moves = (np.linalg.norm(own, axis=2) > least).any(axis=1)
    for k in np.flatnonzero(moves):
        left = own[k] - _drift(mesh.shapes[k], len(mesh.points), moving)
        moves[k] = (np.linalg.norm(left, axis=1) > least).any()
    return np.asarray(moves)


def _drift(shape: BlendShape, count: int, moving: IntArray) -> FloatArray:
    """Return by how much a shape moves most of the moving skin: (3,)."""
    if 2 * len(shape.indices) < len(moving):
        return np.zeros(3)
    offsets = np.zeros((count, 3))
    offsets[shape.indices] = shape.offsets
    return np.asarray(np.median(offsets[moving], axis=0))


def _neighbours(at: FloatArray, vertices: IntArray, among: IntArray, reach: float) -> IntArray:
    """Return the pairs (P, 2) of `vertices` and the nearest of `among`, nearest first."""
    count = min(_NEIGHBOURS, len(among))
    if not count:
        return _NONE
    distance, near = cKDTree(at[among]).query(at[vertices], k=count, distance_upper_bound=reach)
    distance, near = distance.reshape(-1), near.reshape(-1)
    order = np.argsort(distance, kind="stable")[: int(np.isfinite(distance).sum())]
    pairs = [np.repeat(vertices, count)[order], among[near[order]]]
    return np.asarray(np.stack(pairs, axis=1), dtype=np.int64)


def _facing(pairs: IntArray, skin: _Skin) -> BoolArray:
    a, b = pairs.T
    direction = skin.points[b] - skin.points[a]
    length = np.linalg.norm(direction, axis=1)
    least = _FACING * length
    inward = (skin.normals[a] * direction).sum(axis=1) > least
    opposed = (skin.normals[b] * direction).sum(axis=1) < -least
    return np.asarray((length > 0) & inward & opposed & (skin.piece[a] == skin.piece[b]))


def _mutual(pairs: IntArray) -> IntArray:
    """Return the pairs, nearest first, of which each is the other's nearest."""
    first = pairs[np.sort(np.unique(pairs[:, 0], return_index=True)[1])]
    partner = dict(first.tolist())
    kept = [(a, b) for a, b in first.tolist() if a < b and partner.get(b) == a]
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


def _lips(mesh: Mesh, skin: _Skin, moving: IntArray) -> IntArray:
    pairs = _neighbours(skin.points, moving, moving, _CLOSE * skin.spread)
    pairs = _mutual(pairs[_facing(pairs, skin)])
    a, b = pairs.T
    direction = skin.points[b] - skin.points[a]
    gap = np.linalg.norm(direction, axis=1)
    apart = ((mesh.offsets_at(b) - mesh.offsets_at(a)) * direction).sum(axis=2) / np.maximum(
        gap, 1e-12
    )
    parting = apart.max(axis=0, initial=0.0)
    parted = parting > np.maximum(_TIMES * gap, _DRAWN_APART * skin.spread)
    return np.asarray(pairs[parted], dtype=np.int64)


def _closed_by(shape: BlendShape, skin: _Skin) -> IntArray:
    """Return the pairs with a gap that a shape closes."""
    size = np.linalg.norm(shape.offsets, axis=1)
    moved = shape.indices[(size > _STILL * skin.spread) & skin.large[shape.indices]]
    if len(moved) < 2:
        return _NONE
    at = skin.points.copy()
    at[shape.indices] += shape.offsets
    reach = _CLOSE * skin.spread
    low, high = at[moved].min(axis=0) - reach, at[moved].max(axis=0) + reach
    among = np.flatnonzero(((at >= low) & (at <= high)).all(axis=1))
    pairs = _neighbours(at, moved, among, reach)
    before = np.linalg.norm(skin.points[pairs[:, 1]] - skin.points[pairs[:, 0]], axis=1)
    after = np.linalg.norm(at[pairs[:, 1]] - at[pairs[:, 0]], axis=1)
    least, most = (share * skin.spread for share in _LID_GAP)
    closed = (before > least) & (before < most) & (after < _CLOSED * before)
    pairs = pairs[closed & _facing(pairs, skin)]
    first = np.sort(np.unique(pairs[:, 0], return_index=True)[1])
    return np.asarray(pairs[first], dtype=np.int64)


def _upper_first(pairs: IntArray, skin: _Skin) -> IntArray:
    """Put the upper vertex of each pair first, and pairs in order."""
    y = skin.points[pairs, 1]
    turned = np.where((y[:, :1] < y[:, 1:]), pairs[:, ::-1], pairs)
    return np.unique(turned.reshape(-1, 2), axis=0)
