"""Evidence of a take's motion for a space map and for the places of the markers.

The right map is not the one that best predicts where resting markers lie, but the one with which
the character's shapes explain how the markers move. The part of the displacements that no weight
and no head motion explains is divided by their size, so that a map gains nothing by making motions
small. No solve is needed.
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solver.noise import independent_lags
from usdface.retarget.solver.residual_space import ResidualSpace
from usdface.takes import visible

__all__ = ["MotionEvidence"]

# The take is no evidence where shapes and head leave fewer degrees of freedom of a frame, or where
# its motion is below these many noise variances, or this share of the face's size. Set by hand.
_FEWEST_LEFT = 6
_ROUNDING = 1e-7
_ABOVE_NOISE = 4.0


@dataclass(frozen=True, eq=False, slots=True)
class MotionEvidence:
    """The markers' motion in a take, the head's taken out.

    Attributes
    ----------
    times : (F,) float64 [s]
    markers : (F, M, D) float64
        In the pose of the neutral frames; NaN where occluded.
    """

    times: FloatArray
    markers: FloatArray

    def unexplained_share(
        self, space: SpaceMap, points: FloatArray, evaluator: BlendShapeEvaluator
    ) -> float:
        """Return the share of the displacements that shapes and head do not explain: RMS by RMS.

        Noise is subtracted from both. NaN if the take is no evidence: it does not move, or the
        shapes can explain any motion.

        Parameters
        ----------
        space : SpaceMap
        points : (M, 3) float64 [m]
            Neutral places on the character.
        evaluator : BlendShapeEvaluator
            Of displacements there, N = 3 M.
        """
        axes = self.markers.shape[2]
        displaced = space.displacements(self.markers)[..., :axes]
        seen = np.repeat(visible(self.markers), axes, axis=1)
        flat = np.where(seen, displaced.reshape(len(displaced), -1), 0.0)
        coordinates = np.arange(3 * len(points)).reshape(-1, 3)[:, :axes].ravel()
        rigid = motion_basis(points, axes)
        directions = evaluator.select(coordinates).directions
        lags = independent_lags(self.times)
        residual = ResidualSpace.beside_head(directions, rigid, points, seen, lags)
        left, count = residual.squares(flat)
        if not len(left) or np.median(count) < _FEWEST_LEFT:
            return np.nan
        noise = residual.noise(flat) ** 2
        size = float(ResidualSpace.of(rigid.T, seen).squares(flat)[0].mean())
        rounding = (_ROUNDING * rms_radius(points)) ** 2
        if size <= max(_ABOVE_NOISE * noise, rounding):
            return np.nan
        return float(np.sqrt(max(float(left.mean()) - noise, 0.0) / (size - noise)))
