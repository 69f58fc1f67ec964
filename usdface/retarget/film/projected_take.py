"""Displacements of markers in the view of a camera, and the shapes that explain them.

Displacements D w of the markers in head space are observed as V_t D w, with V_t the camera's view
of every marker in frame t (`usdface.retarget.film.views`): lips that come forward are visible on a
head that looks aside, but not on one that looks at the camera.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_modes import motion_basis
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.film.views import Views
from usdface.retarget.solver.noise import typical_deviation
from usdface.retarget.solver.residual_space import EXPRESSIVE_QUANTILE

__all__ = ["ProjectedTake"]

# A ridge above the rounding error, of the mean diagonal entry; singular values below its root
# explain nothing.
_ROUNDING = 1e-10
# Error of filmed dots over the take's stated deviation: correlated errors (compression, slant,
# shading) are not in that deviation, and are not misfit. RMS errors about their mean are 1.07 to
# 1.31 of the stated deviation (six films before a phone).
_LASTING = 1.3
# Frames at a time: the displacements of 53 shapes and 68 markers have 22 MB.
_BLOCK = 256
# Coordinates of which no more than this share is unexplained are no evidence of noise.
_LEFT = 0.05


@dataclass(frozen=True, eq=False)
class ProjectedTake:
    """Displacements in the view of the camera, and the shapes that explain them.

    Attributes
    ----------
    model : BlendShapeEvaluator
    views : Views
        Certain of nothing where a marker is occluded.
    observed : (F, 2 M) float64 [m]
    target : (M, 3) float64 [m]
    moving : bool
        The head's small motions are left out.
    """

    model: BlendShapeEvaluator
    views: Views
    observed: FloatArray
    target: FloatArray
    moving: bool

    def at(self, frames: BoolArray) -> "ProjectedTake":
        """Return the same of some frames (F,)."""
        views = self.views.at(frames)
        return ProjectedTake(self.model, views, self.observed[frames], self.target, self.moving)

    @cached_property
    def turns(self) -> FloatArray:
        """Orthonormal small head motions in the view of the camera: (F, 2 M, 6 or 0).

        Zeros in place of those that are not visible: a camera far away sees no depth.
        """
        count = len(self.observed)
        if not self.moving:
            return np.zeros((count, self.observed.shape[1], 0))
        basis = np.broadcast_to(motion_basis(self.target, 3).T, (count, 6, self.target.size))
        projected = self.views.weighted(self.views.projected(basis)).transpose(0, 2, 1)
        directions, size, _ = np.linalg.svd(projected, full_matrices=False)
        visible = size > np.sqrt(_ROUNDING) * size[:, :1]
        return np.asarray(directions * visible[:, None])

    def left(self, weights: FloatArray) -> FloatArray:
        """Return the residual of complete weights (F, S): (F, 2 M) [m]."""
        projected = self.views.projected(self.model.displacements(weights))
        return self._still(self.views.weighted(self.observed - projected))

    def _still(self, values: FloatArray) -> FloatArray:
        turned = self.turns.transpose(0, 2, 1) @ values[..., None]
        return np.asarray(values - (self.turns @ turned)[..., 0])

    def equations(self, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return normal matrices (F, P, P) and right-hand sides (F, P) about weights (F, P)."""
        count = free.shape[1]

        def both(block: slice) -> FloatArray:
            slopes = self._directions(self._slopes(free[block]), block)
            normal = slopes @ slopes.transpose(0, 2, 1)
            right = (slopes @ left[block][..., None])[..., 0]
            right += (normal @ free[block][..., None])[..., 0]
            return np.concatenate([normal, right[:, None]], axis=1)

        left = self.left(self.model.complete(free))
        found = by_blocks(len(free), both, _BLOCK)
        return found[:, :count], found[:, count]

    def _slopes(self, free: FloatArray) -> FloatArray:
        """Return the displacements by each free shape at some weights: (F or 1, P, 3 M)."""
        if self.model.linear:
            return self.model.offsets[self.model.free][None]
        full = self.model.complete(free)
        return self.model.secants(full, full)

    def _directions(self, displacements: FloatArray, block: slice) -> FloatArray:
        """Return displacements (F or 1, K, 3 M) in the view, without head motion: (F, K, 2 M)."""
        views, turns = self.views.at(block), self.turns[block]
        projected = views.weighted(views.projected(displacements))
        return np.asarray(projected - (projected @ turns) @ turns.transpose(0, 2, 1))

    @cached_property
    def unexplained(self) -> tuple[FloatArray, FloatArray]:
        """Unexplained displacements (F, 2 M) [m], and the unexplained share of each (F, 2 M)."""
        directions = self.model.directions
        values = self._still(self.views.weighted(self.observed))

        def rest(block: slice) -> FloatArray:
            views, own = self.views.at(block), values[block]
            projected = self._directions(directions[None], block)
            normal = projected @ projected.transpose(0, 2, 1)
            size = np.trace(normal, axis1=1, axis2=2)[:, None, None] / len(directions)
            normal += (_ROUNDING * size + 1e-300) * np.eye(len(directions))
            solved = np.linalg.solve(normal, projected)
            along = (projected @ own[..., None])[..., 0]
            share = (np.repeat(views.certainty, 2, axis=1) > 0.0) - (projected * solved).sum(axis=1)
            share = (share - (self.turns[block] ** 2).sum(axis=2)).clip(0.0, 1.0)
            return np.stack([own - (along[:, None] @ solved)[:, 0], share], axis=1)

        found = by_blocks(len(self.observed), rest, _BLOCK)
        return found[:, 0], found[:, 1]

    def noise(self) -> float:
        """Estimate the white noise of coordinates by third differences in time [m]."""
        left, share = self.unexplained
        if len(left) < 4:
            return 0.0
        four = np.lib.stride_tricks.sliding_window_view(share, 4, axis=0)
        shown = four.min(axis=-1) > _LEFT
        third = np.diff(left, 3, axis=0)[shown] / np.sqrt(four.mean(axis=-1)[shown])
        return typical_deviation(third)

    def misfit(self, noise: float) -> float:
        """Estimate the difference of face and rig [m], as `ResidualSpace.misfit` does."""
        left, share = self.unexplained
        count = share.sum(axis=1)
        enough = count > 1.0
        if not enough.any():
            return 0.0
        squares, count = (left[enough] ** 2).sum(axis=1) / count[enough], count[enough]
        excess = (
            squares - (_LASTING * noise) ** 2 * chdtri(count, 1.0 - EXPRESSIVE_QUANTILE) / count
        )
        return float(np.sqrt(max(0.0, float(np.quantile(excess, EXPRESSIVE_QUANTILE)))))
