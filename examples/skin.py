"""The head's skin as something to pull at: lips and lids are led, the rest follows elastically."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from examples.rings import LIP_RINGS, POCKET_RINGS, SOCK_RINGS
from examples.sculpt import EYE
from examples.topology import HeadMesh
from usdface.arrays import FloatArray

# How far the rings behind a lid, its rim, and the rings before it go with the rim.
LID_SHARES = (0.8, 0.9, 1, 1, 1, 0.66, 0.25)

__all__ = ["MM", "Skin", "smooth"]

MM = 1e-3


def smooth(x: FloatArray) -> FloatArray:
    """Return the smooth step from 0 at x <= 0 to 1 at x >= 1."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


class Skin:
    """The head's skin with its loops: turns led loops and bumps into displacements."""

    def __init__(self, head: HeadMesh) -> None:
        self.points, self.mirror = head.points, head.mirror
        self.lids = head.eyes[0]
        self.lips = head.mouth[SOCK_RINGS - 2 : SOCK_RINGS + LIP_RINGS]
        self.sock = head.mouth[: SOCK_RINGS - 2]
        angle = np.pi * np.arange(head.mouth.shape[1]) / (head.mouth.shape[1] // 2)
        self.side = -np.cos(angle)  # -1 at the right corner, 1 at the left
        self.rise = np.abs(np.sin(angle))  # 0 at the corners, 1 at the middle
        self.upper = (np.sin(angle) > 1e-9) + 0.5 * (np.abs(np.sin(angle)) <= 1e-9)
        a = np.concatenate([np.array(f) for f in head.faces])
        b = np.concatenate([np.roll(f, -1) for f in head.faces])
        link = coo_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a]))).tocsr()
        link.data[:] = 1
        degree = np.asarray(link.sum(axis=1)).ravel()
        bend = diags_array(1 / degree) @ link - diags_array(np.ones(len(degree)))
        self._bending = (bend.T @ bend).tocsc()
        self.lid_share = np.ones(len(self.points))  # 0 on the lids, 1 from the orbit outwards
        for eye in head.eyes:
            ring = np.maximum(np.arange(len(eye)) - POCKET_RINGS, 0)
            self.lid_share[eye] = smooth((ring - 2.0) / 5)[:, None]

    def spread(self, targets: FloatArray, firm: FloatArray, reach: float = 7.0) -> FloatArray:
        """Return the smoothest displacement (V, 3) [m] that follows `targets` where `firm` > 0.

        Elsewhere it dies away within about `reach` edges.
        """
        matrix = self._bending + diags_array(firm + reach**-4)
        return np.asarray(splu(matrix.tocsc()).solve(firm[:, None] * targets))

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """What no mouth shape moves: lids, forehead, back of the head, neck."""
        _, y, z = self.points.T
        return np.asarray((self.lid_share < 0.3) | (y > 0.012) | (y < -0.135) | (z < -0.01))

    def mouth(
        self,
        upper: FloatArray,
        lower: FloatArray,
        hold: NDArray[np.bool_] | None = None,
        rings: tuple[float, ...] = (0.9, 1, 1, 1, 1, 0.9),
    ) -> FloatArray:
        """Lead the lips: displacements (L, 3) for the loop as upper and as lower lip.

        `rings` scales them from behind the lips to their border; `hold` keeps more vertices.
        """
        share = self.upper[:, None]
        loop = share * upper + (1 - share) * lower
        targets, firm = np.zeros_like(self.points), np.zeros(len(self.points))
        firm[self.still if hold is None else self.still | hold] = 10
        for ring, scale in zip(self.lips, rings, strict=True):
            targets[ring], firm[ring] = scale * loop, 30
        return self.spread(targets, firm)

    def along(self, profile: FloatArray, *millimetres: float) -> FloatArray:
        """Return displacements (L, 3) along the loop: a profile (L,) times a vector [mm]."""
        return np.asarray(profile[:, None] * np.array(millimetres) * MM)

    def bump(
        self,
        centre: tuple[float, float, float],
        radii: tuple[float, float, float],
        *millimetres: float,
    ) -> FloatArray:
        """Return a soft bump (V, 3): a vector [mm] that dies away from a centre [m]."""
        q = (self.points - centre) / radii
        fall = np.exp(-0.5 * (q**2).sum(axis=1))
        inside = np.ones(len(fall))
        inside[self.lips], inside[self.sock] = 0, 0
        return np.asarray((fall * inside * self.lid_share)[:, None] * np.array(millimetres) * MM)

    def lid(
        self, upper: FloatArray, lower: FloatArray, lift: FloatArray | float = 0.0
    ) -> FloatArray:
        """Lead the left lids over the eyeball: the rim's frontal shift (L, 2) as upper, as lower.

        `lift` (L, 1) [m] is added to the distance from the eye's centre, so that a lid does not
        cut into the ball on its straight way.
        """
        eye, points = self.lids, self.points
        loop = eye.shape[1]
        is_upper = (np.arange(loop) <= loop // 2)[:, None]
        shift = np.where(is_upper, upper, lower)
        targets, firm = np.zeros_like(points), np.zeros(len(points))
        firm[(self.lid_share >= 1) | (points[:, 0] < 0.004)] = 30
        size = np.linalg.norm(shift, axis=1, keepdims=True)
        for row, share in enumerate(LID_SHARES):
            ring = eye[row]
            local = points[ring] - EYE
            radius = np.linalg.norm(local, axis=1, keepdims=True)
            moved = local.copy()
            moved[:, :2] += share * shift
            inside = np.minimum(1, 0.995 * radius / np.linalg.norm(moved[:, :2], axis=1)[:, None])
            moved[:, :2] *= inside
            depth = np.sqrt(np.maximum(radius**2 - (moved[:, :2] ** 2).sum(axis=1)[:, None], 0))
            moved[:, 2:] = np.where(size > 0, depth, local[:, 2:])
            moved *= 1 + share * lift / radius
            targets[ring], firm[ring] = moved - local, 100
        return self.spread(targets, firm)
