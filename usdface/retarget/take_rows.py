"""The least-squares rows of a take: displacements of the markers by blend shapes and by the head.

Small head motions are projected out of them, so that one normal matrix serves the whole take. The
rows of each marker are divided by its error (generalised least squares).
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.nonlinear_solve import (
    NonlinearProblem,
    first_guess,
    solve_nonlinear,
)
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import Iterate, solve_weights, with_learned_covariance

__all__ = ["TakeRows"]

# Steps of a nonlinear solve in a round. Set by hand; docs/constants.md.
_ROUGH = 4


@dataclass(frozen=True, eq=False, slots=True)
class TakeRows:
    """The rows of one frame, alike in all of them.

    Attributes
    ----------
    axes : int
        2 for an image, which has no depth; else 3.
    model : BlendShapeEvaluator
        Of M * axes coordinates, P of its shapes with a weight of their own.
    rigid : (M * axes, K) float64
        Orthonormal small head motions, K = 6 or 0.
    errors : (M * axes,) float64 [1]
        Of a coordinate, by those of the markers around it.
    weighted : BlendShapeEvaluator
        `model` by the errors.
    weighted_rigid : (M * axes, K) float64
        Orthonormal basis of `rigid` by the errors.
    """

    axes: int
    model: BlendShapeEvaluator
    rigid: FloatArray
    errors: FloatArray
    weighted: BlendShapeEvaluator
    weighted_rigid: FloatArray

    @classmethod
    def of(cls, motion: MotionModel, errors: FloatArray | None = None) -> "TakeRows":
        """Return the rows of markers that move by a model.

        The `errors` (M,) [1] of the markers are equal, if left out.
        """
        axes, seen, rigid = motion.axes, motion.coordinates, motion.head_basis()
        model = motion.shapes.select(seen)
        if errors is None:
            return cls(axes, model, rigid, np.ones(len(seen)), model, rigid)
        each, weighted = np.repeat(errors, axes), motion.head_basis(errors)
        return cls(axes, model, rigid, each, model.mapped(lambda values: values / each), weighted)

    @property
    def marker_weights(self) -> FloatArray | None:
        """Weights (M,) of the markers' squared distances; None where they are equal."""
        each = self.errors[:: self.axes]
        return None if (each == 1.0).all() else 1.0 / each**2

    def with_still_head(self) -> "TakeRows":
        """Return the rows of a head whose pose is known: no motion of it is projected out."""
        return replace(self, rigid=self.rigid[:, :0], weighted_rigid=self.weighted_rigid[:, :0])

    def rigid_part(self, displacements: FloatArray) -> FloatArray:
        """Return the part of displacements (F, M * axes) that small head motions explain."""
        along = (displacements / self.errors) @ self.weighted_rigid
        return np.asarray(along @ self.weighted_rigid.T * self.errors)

    def displacements(self, weights: FloatArray) -> FloatArray:
        """Return the markers' displacements by free weights (F, P): (F, M * axes)."""
        return self.model.displacements(self.model.complete(weights))

    def equations(self, observed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return normal matrix (P, P) [m^2] and right-hand sides (F, P) [m^2] of a linear model.

        `observed` (F, M * axes) [m] are displacements.
        """
        offsets, rigid = self.weighted.offsets, self.weighted_rigid
        shapes = offsets - (offsets @ rigid) @ rigid.T
        return shapes @ shapes.T, (observed / self.errors) @ shapes.T

    def solve(
        self,
        observed: FloatArray,
        times: FloatArray,
        regularisation: Regularisation,
        start: Iterate | None,
        final: Bounds | None = None,
    ) -> Iterate:
        """Solve the free weights (F, P) for displacements (F, M * axes) [m] at `times` (F,) [s].

        Without `final` bounds a few steps are taken only.
        """
        model, rigid, rough = self.weighted, self.weighted_rigid, final is None
        bounds = final or Bounds(rows=model.limit_rows)
        if model.linear:
            normal, right = self.equations(observed)
            return solve_weights(normal, right, times, regularisation, start, rough, bounds)
        problem = NonlinearProblem(model, rigid, observed / self.errors, times, regularisation)
        steps = {"steps": _ROUGH} if rough else {}
        return solve_nonlinear(problem, start or first_guess(problem), bounds, **steps)

    def learned(
        self,
        observed: FloatArray,
        times: FloatArray,
        regularisation: Regularisation,
        start: Iterate | None,
    ) -> Regularisation:
        """Learn the covariance of the free weights from this take, if that is possible.

        `observed` (F, M * axes) [m] are displacements without gaps, at `times` (F,) [s].
        """
        if not self.model.linear:
            return regularisation
        return with_learned_covariance(*self.equations(observed), times, regularisation, start)
