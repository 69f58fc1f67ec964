"""The joints of each point, cut down to the strongest, and how far that moves a point at most.

With full weights w and the kept ones w', which both add up to 1, a point x that blend shapes bring
at most r away from its rest x0 moves by

    |sum_j (w_j - w'_j) (x, 1) M_j| <= |(x0, 1) G| + r |A|,  G = sum_j (w_j - w'_j) M_j,

where A is the linear part of G and |A| its Frobenius norm. Where that is too much to compute, each
joint is compared with the strongest one of its points, in the box around these: the distance
between two affine images of a point is convex, so it is largest at a corner.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.inbetween_path import inbetween_path
from usdface.clips import Clip
from usdface.findings import Finding, finding
from usdface.io.gltf.write_skin import sorted_influences
from usdface.io.joint_poses import skinning_transforms
from usdface.rigs import Mesh, Skeleton, Skin

__all__ = ["limit_influences"]

_READ = 4  # joints of a point that every program reads
_MOST = 2**23  # products of a point, a joint and a frame that are computed; else the boxes


def limit_influences(
    mesh: Mesh, skeleton: Skeleton, clips: Sequence[Clip], most: int = 0
) -> tuple[Mesh, list[Finding]]:
    """Return a mesh of which each point is held by its `most` strongest joints; 0 keeps all.

    Returns
    -------
    Mesh
    list of Finding
        INFLUENCES_REDUCED by how much a point is off at most, at rest and in all frames of the
        clips. INFLUENCES_MANY of points that keep more than four: by how much they are off in
        programs that read four.
    """
    found = []
    if most and (cut := _cut(mesh, skeleton, clips, most)):
        message = (
            "{point_count} points keep their {influence_count} strongest joints, and are at most "
            "{error_mm:.3g} mm off"
        )
        values = (len(cut.points), most, 1e3 * cut.largest(clips))
        found.append(finding("INFLUENCES_REDUCED", mesh.name, message, *values))
        mesh = replace(mesh, skin=cut.skin)
    if cut := _cut(mesh, skeleton, clips, _READ):
        message = (
            "{point_count} points have more than {influence_count} joints; programs that "
            "read the strongest only leave out up to {left_out_percent:.2g} % of a point's "
            "weight, and show it at most {error_mm:.3g} mm off"
        )
        shares = 100 * cut.lost, 1e3 * cut.largest(clips)
        found.append(
            finding("INFLUENCES_MANY", mesh.name, message, len(cut.points), _READ, *shares)
        )
    return mesh, found


def _cut(mesh: Mesh, skeleton: Skeleton, clips: Sequence[Clip], most: int) -> "_Cut | None":
    """Return the change by cutting down to `most` joints; None if there is none."""
    if mesh.skin is None or mesh.skin.joints.shape[1] <= most:
        return None
    joints, weights = sorted_influences(
        mesh.skin, len(mesh.points), len(skeleton.joints), mesh.name
    )
    full = weights.astype(np.float64)
    lost = full[:, most:].sum(axis=1)
    points = np.flatnonzero(lost > 0)
    if not len(points):
        return None
    fewer = np.where(np.arange(full.shape[1]) < most, full, 0)
    fewer /= fewer.sum(axis=1, keepdims=True)
    reach = _reach(mesh, clips)[points]
    skin = Skin(joints[:, :most], fewer[:, :most])
    place = mesh.points[points]
    change = (full - fewer)[points]
    return _Cut(skeleton, skin, float(lost.max()), points, place, reach, joints[points], change)


def _reach(mesh: Mesh, clips: Sequence[Clip]) -> FloatArray:
    """Return how far blend shapes move each point in the clips at most: (V,) [m]."""
    reach = np.zeros(len(mesh.points))
    takes = [clip.weights for clip in clips if clip.weights is not None]
    for shape in mesh.shapes:
        columns = [take.column(shape.name) for take in takes if shape.name in take.names]
        if not columns:
            continue
        low = min(float(column.min()) for column in columns)
        high = max(float(column.max()) for column in columns)
        knots = inbetween_path(shape).knots_between(low, high)
        moves = np.linalg.norm(knots.reshape(len(knots), *shape.offsets.shape), axis=2)
        reach[shape.indices] += moves.max(axis=0)
    return reach


@dataclass(frozen=True, eq=False, slots=True)
class _Cut:
    """Points (N,) that lose joints.

    `skin` is that of the whole mesh afterwards, `lost` the largest weight that is left out;
    `places` (N, 3) and `reach` (N,) are where the points are at rest and how far shapes bring
    them, `change` (N, K) by how much the weights of `joints` (N, K) change.
    """

    skeleton: Skeleton
    skin: Skin
    lost: float
    points: IntArray
    places: FloatArray
    reach: FloatArray
    joints: IntArray
    change: FloatArray

    def largest(self, clips: Sequence[Clip]) -> float:
        """Return the largest distance [m] of a point from its place with all joints."""
        takes = [clip.joints for clip in clips if clip.joints is not None]
        largest = 0.0
        for moves in (skinning_transforms(self.skeleton, take) for take in (None, *takes)):
            few = len(moves) * self.joints.size <= _MOST
            largest = max(largest, self._computed(moves) if few else self._bounded(moves))
        return largest

    def _computed(self, moves: FloatArray) -> float:
        largest = 0.0
        full = np.concatenate([self.places, np.ones((len(self.places), 1))], axis=1)
        for pose in moves:
            mixed = np.einsum("nk,nkij->nij", self.change, pose[self.joints][..., :3])
            off = np.linalg.norm(np.einsum("ni,nij->nj", full, mixed), axis=1)
            off += self.reach * np.linalg.norm(mixed[:, :3], axis=(1, 2))
            largest = max(largest, float(off.max()))
        return largest

    def _bounded(self, moves: FloatArray) -> float:
        first = np.broadcast_to(self.joints[:, :1], self.joints.shape)
        pairs = np.stack([first, self.joints], 2).reshape(-1, 2)
        known, place = np.unique(pairs, axis=0, return_inverse=True)
        place = place.reshape(self.joints.shape)
        held = np.abs(self.change)
        apart = np.zeros(len(known))
        for k, (one, other) in enumerate(known.tolist()):
            own = ((place == k) & (held > 0)).any(axis=1)
            if one == other or not own.any():
                continue
            reach = self.reach[own, None]
            low = (self.places[own] - reach).min(axis=0)
            high = (self.places[own] + reach).max(axis=0)
            corners = np.array(list(itertools.product(*zip(low, high, strict=True), (1.0,))))
            gap = corners @ (moves[:, one] - moves[:, other])[..., :3]
            apart[k] = np.linalg.norm(gap, axis=2).max()
        return float((held * apart[place]).sum(axis=1).max())
