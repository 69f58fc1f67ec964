"""Nonlinear solve: blend shapes with inbetweens and combination shapes, at the same speed.

Gauss-Newton steps need a matrix for each frame, which would be too slow for whole takes.
Instead each step minimises a model of the true sum of squares that has the right value and
gradient but one matrix N for all frames (majorisation, Lange 2016; with the exact matrix it
would be Gauss-Newton)::

    |f(w) - y|^2 / 2  ~  g' (w - u) + (w - u)' N (w - u) / 2,   g = J(u)' (f(u) - y)

so that the linear solver does the step, with all bounds and the smoothness, for the right-hand
side N u - g. A step that does not lower the true sum is halved; where frames do not depend on each
other, each for itself. Steps are extrapolated (Anderson 1965), per frame, from the last few: the
difference from linear shapes is of low rank, so a few steps are enough.

Inbetweens and combinations cause local minima. The first guess is therefore that of a wider linear
problem, in which each inbetween and each combination shape has a weight of its own: where the
markers distinguish them it is already the solution.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights
from usdface.retarget.solver.temporal_solve import Iterate
from usdface.retarget.solver.terms import roughness

__all__ = ["NonlinearProblem", "first_guess", "solve_nonlinear"]

# Set by hand: number of steps, of halvings of a step that does not lower the sum, of past steps.
_STEPS = 60
_HALVINGS = 6  # down to a sixty-fourth of a step
_MEMORY = 6  # steps that are extrapolated from
# Of the mean diagonal entry: a ridge far below any error of a marker, far above rounding.
_RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class NonlinearProblem:
    """The true sum of squares, with ridge and smoothness: per frame, or of the whole take.

    Attributes
    ----------
    model : BlendShapeEvaluator
    rigid : (N, K) float64
        Orthonormal small head motions, which are left out of the sum.
    observed : (F, N) float64 [m]
        Displacements of the markers.
    times : (F,) float64 [s]
    regularisation : Regularisation
        Without a covariance.
    """

    model: BlendShapeEvaluator
    rigid: FloatArray
    observed: FloatArray
    times: FloatArray
    regularisation: Regularisation

    @cached_property
    def _bands(self) -> FloatArray | None:
        """Of the smoothness; None where each frame is alone."""
        bands = self.regularisation.bands(self.times)
        alone = self.regularisation.options.mode == "frame" or not bands.any()
        return None if alone else bands

    def _forces(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        full = self.model.complete(weights)
        return full, self.without_head(self.model.displacements(full) - self.observed)

    def without_head(self, displacements: FloatArray) -> FloatArray:
        """Return displacements (..., N) without small head motions."""
        return displacements - (displacements @ self.rigid) @ self.rigid.T

    def value(self, weights: FloatArray) -> FloatArray:
        """Return the sum of each frame (F,); of the whole take, the same for all, if coupled."""
        _, forces = self._forces(weights)
        own = 0.5 * (forces**2).sum(axis=1) + self.regularisation.value(weights)
        if self._bands is None:
            return np.asarray(own)
        return np.full(len(weights), own.sum() + 0.5 * roughness(self._bands, weights))

    def gradient(self, weights: FloatArray) -> FloatArray:
        """Return the gradient of the squares alone: (F, P)."""
        return self.model.gradient(*self._forces(weights))


def solve_nonlinear(
    problem: NonlinearProblem, start: Iterate, bounds: Bounds, steps: int = _STEPS
) -> Iterate:
    """Solve for the free weights of all frames.

    Parameters
    ----------
    problem : NonlinearProblem
    start : Iterate
        Where to start; also the answer if no step lowers the sum.
    bounds : Bounds
    steps : int
        Largest number of them.
    """
    model, times, regularisation = problem.model, problem.times, problem.regularisation
    straight = problem.without_head(model.offsets[model.free])
    normal = straight @ straight.T
    low, high = bounds.over(len(times), len(normal))
    weights = np.clip(start.weights, low, high)
    if len(bounds.rows):  # only the start may violate them
        right = weights @ normal - problem.gradient(weights)
        weights = solve_weights(normal, right, times, regularisation, start, bounds=bounds).weights
    value, gradient = problem.value(weights), problem.gradient(weights)
    past: list[tuple[FloatArray, FloatArray]] = []
    iterate = replace(start, weights=weights)
    for _ in range(steps):
        right = weights @ normal - gradient
        iterate = solve_weights(normal, right, times, regularisation, iterate, bounds=bounds)
        step = iterate.weights - weights
        if np.abs(step).max(initial=0.0) < 0.1 * regularisation.options.tolerance:
            break
        past = [*past, (weights, step)][-_MEMORY:]
        ahead = np.clip(_extrapolated(past), low, high)
        if len(bounds.rows):
            ahead = iterate.weights
        found, at = ahead, problem.value(ahead)
        worse = at > value
        size = 1.0
        for _ in range(_HALVINGS):
            if not worse.any():
                break
            tried = np.where(worse[:, None], weights + size * step, found)
            found, at = tried, problem.value(tried)
            worse, size = at > value, 0.5 * size
        found = np.where(worse[:, None], weights, found)
        if (found == weights).all():
            break
        weights, value = found, problem.value(found)
        gradient = problem.gradient(weights)
    return replace(iterate, weights=weights)


def first_guess(problem: NonlinearProblem) -> Iterate:
    """Return the free weights (F, P) of the wider linear problem.

    In it each inbetween and each combination shape has a weight of its own.
    """
    model, regularisation = problem.model, problem.regularisation
    inner = [
        (p, k)
        for p in model.inbetweens
        for k in range(len(p.weights))
        if p.weights[k] not in (0, 1)
    ]
    wide = np.vstack(
        [
            model.offsets[model.free],
            *(p.displacements[k : k + 1] for p, k in inner),
            *(model.offsets[c.shape : c.shape + 1] for c in model.combinations),
        ]
    )
    wide = problem.without_head(wide)
    normal = wide @ wide.T
    # Shapes that the markers do not distinguish get equal weights.
    normal += _RIDGE * normal.trace() / len(normal) * np.eye(len(normal))
    # A term by shape does not apply to the additional shapes.
    alike = tuple(term for term in regularisation.terms if not term.by_shape)
    held = replace(regularisation, names=(), terms=alike)
    found = solve_weights(normal, problem.observed @ wide.T, problem.times, held, rough=True)
    count = len(model.free)
    weights = found.weights[:, :count].copy()
    place = {shape: column for column, shape in enumerate(model.free.tolist())}
    for column, (path, k) in enumerate(inner, count):
        if path.shape in place:
            weights[:, place[path.shape]] += path.weights[k] * found.weights[:, column]
    return Iterate(np.clip(weights, 0.0, 1.0))


def _extrapolated(past: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Extrapolate the last steps, each frame by itself (Anderson mixing): (F, P)."""
    weights, step = past[-1]
    if len(past) == 1:
        return weights + step
    steps = np.stack([s for _, s in past], axis=1)
    places = np.stack([w for w, _ in past], axis=1)
    change, moved = np.diff(steps, axis=1), np.diff(places + steps, axis=1)
    square = change @ change.transpose(0, 2, 1)
    size = np.trace(square, axis1=1, axis2=2)[:, None, None]
    square = square + (1e-10 * size + 1e-300) * np.eye(square.shape[1])
    mixed = np.linalg.solve(square, (change @ step[..., None]))
    return np.asarray(weights + step - (mixed.transpose(0, 2, 1) @ moved)[:, 0])
