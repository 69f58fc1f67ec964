"""Errors of the markers' motion over the frames of a solved take.

By the same blend shape two people move in somewhat different directions. That error is in
proportion to the motion and returns with it, so that more frames of one movement are no more
evidence. Over the frames the error of a marker coordinate has the covariance

    K = r v I + W S W'

with v the variance of the error, of which r frames in a row count as one, W the weights and S the
variances of the errors of the blend shapes, in the ratio of misfit to motion.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.residual_space import EXPRESSIVE_QUANTILE
from usdface.takes import visible

__all__ = ["MotionErrors"]

# Errors are correlated in time: this many frames count as one. On performers 1 to 4 of python -m
# benchmarks.performers, 20 s, with places off by 4 mm 30 gives 0.0417 / 0.177 mm, 10 gives 0.0422 /
# 0.179; without errors of the shapes 30 gives 0.0438 / 0.182. Where places are right all are equal.
_REPEATED = 30.0


@dataclass(frozen=True, eq=False, slots=True)
class MotionErrors:
    """The errors of the displacements of a solved take.

    Attributes
    ----------
    variance : float [m^2]
        Of a marker coordinate in a frame, above 0.
    weights : (F, S) float64
    shape_variances : (S,) float64 [m^2]
        Of a coordinate of each blend shape's displacement at weight 1.
    repeated : float [1]
        Frames that count as one, of the errors that are not the blend shapes'.
    """

    variance: float
    weights: FloatArray
    shape_variances: FloatArray
    repeated: float = _REPEATED

    @classmethod
    def of(
        cls,
        regularisation: Regularisation,
        weights: FloatArray,
        offsets: FloatArray,
        displaced: FloatArray,
    ) -> "MotionErrors":
        """Return the errors of a take by its noise and misfit.

        Parameters
        ----------
        regularisation : Regularisation
            With which the take was solved.
        weights : (F, S) float64
        offsets : (S, 3 M) float64 [m]
            Displacements of the markers by the blend shapes.
        displaced : (F, M, 3) float64 [m]
            Displacements of the markers; NaN where occluded.
        """
        seen = visible(displaced)
        squares = np.where(seen[..., None], displaced, 0.0) ** 2
        moved = squares.sum(axis=(1, 2)) / np.maximum(3 * seen.sum(axis=1), 1)
        motion = float(np.quantile(moved, EXPRESSIVE_QUANTILE))
        share = regularisation.lasting_variance / motion if motion > 0.0 else 0.0
        return cls(regularisation.variance, weights, share * (offsets**2).mean(axis=1))

    def at(self, frames: IntArray) -> "MotionErrors":
        """Return the errors of some frames that stand for all."""
        repeated = self.repeated * len(frames) / max(len(self.weights), 1)
        return replace(self, weights=self.weights[frames], repeated=repeated)

    def weighted(self, values: FloatArray) -> FloatArray:
        """Return values (F, N) times the inverse of K [1/m^2].

        By the matrix inversion lemma, with a matrix of the blend shapes instead of the frames.
        """
        alone = self.repeated * self.variance
        along = self.weights * np.sqrt(self.shape_variances)
        inner = alone * np.eye(along.shape[1]) + along.T @ along
        return np.asarray((values - along @ np.linalg.solve(inner, along.T @ values)) / alone)
