"""Weights of a head that turns before a camera, solved in the view of each image.

The least squares of `usdface.retarget.solver.solve`, with a matrix of its own in every frame
(`usdface.retarget.film.projected_take`)::

    min over 0 <= w <= 1 of   sum_t |(1 - P_t) C_t (V_t D w_t - y_t)|^2 / 2 + the terms

with D the shapes, V_t the camera's view of the markers, C_t the certainty of the samples and P_t
the projector on small head motions in that view. The covariance of the weights is not
learned: with it the weights of four of six films were worse, by up to 1.7 times. Blend shapes with
inbetweens or combinations are solved in Gauss-Newton steps.
"""

from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.geometry.gap_interpolation import interpolate_gaps
from usdface.geometry.marker_spread import rms_radius
from usdface.retarget.film.frame_normals import solve_by_frame
from usdface.retarget.film.projected_take import ProjectedTake
from usdface.retarget.film.views import Views
from usdface.retarget.pins import pin_bounds
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.solve_problem import SolveProblem
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.temporal_solve import Iterate
from usdface.retarget.solver.terms import roughness
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import visible

__all__ = ["solve_projected_weights"]

# Gauss-Newton steps of rigs with inbetweens or combinations, and halvings of one. Set by hand.
_STEPS, _HALVINGS = 12, 5
# A ridge above the rounding error, of the mean diagonal entry.
_ROUNDING = 1e-10


def solve_projected_weights(problem: SolveProblem, views: Views) -> PoseAndWeights:
    """Solve the weights of a face in the view of a camera.

    Parameters
    ----------
    problem : SolveProblem
        Positions in the image, (F, M, 2): neutral markers plus their observed displacements. The
        pose is returned as it is.
    views : Views
        Of these M markers in these frames.
    """
    model, space, times = problem.model, problem.space, problem.times
    is_visible = visible(problem.positions)
    observed = np.nan_to_num(space.displacements(problem.positions)[..., :2])
    observed = observed.reshape(len(times), -1)
    moving = problem.setup.head == "solve"
    film = ProjectedTake(model, views.where(is_visible), observed, problem.target, moving)
    noise = max(film.noise(), problem.least_noise)
    regularisation = Regularisation(
        noise,
        film.misfit(noise),
        problem.setup.solve,
        problem.free_names,
        size=rms_radius(problem.target),
    )
    weights = _solved(film, times, regularisation, problem.setup)
    moved = model.displacements(weights)
    left = (observed - film.views.projected(moved)).reshape(*is_visible.shape, 2)
    displaced = moved.reshape(*is_visible.shape, 3) + (left[:, :, None] @ views.slopes)[:, :, 0]
    displaced = np.where(is_visible[..., None], displaced, np.nan)
    return PoseAndWeights(weights, problem.pose, displaced, regularisation, 1, space)


def _solved(
    film: ProjectedTake, times: FloatArray, regularisation: Regularisation, setup: RetargetSetup
) -> FloatArray:
    """Return complete weights (F, S), with the pins of the setup.

    Frames that show nothing follow their neighbours.
    """
    model, rows = film.model, film.model.limit_rows
    solve = _one_step if model.linear else _gauss_newton
    bounds = Bounds(rows=rows)
    shown = np.asarray(film.views.certainty.any(axis=1))
    part = film if shown.all() else film.at(shown)
    found = Iterate(np.zeros((len(part.observed), len(model.free))))
    found = solve(part, times[shown], regularisation, bounds, found)
    if part is not film:
        weights = np.zeros((len(times), len(model.free)))
        weights[shown] = found.weights
        occluded = np.broadcast_to(~shown[:, None], weights.shape)
        found = Iterate(interpolate_gaps(weights, occluded, times))
    if setup.pins:
        bounds = pin_bounds(setup.pins, regularisation.names, times, found.weights, rows)
        found = solve(film, times, regularisation, bounds, found)
    return model.complete(found.weights)


def _one_step(
    film: ProjectedTake,
    times: FloatArray,
    regularisation: Regularisation,
    bounds: Bounds,
    start: Iterate,
) -> Iterate:
    """Solve for the free weights of all frames, straight on from where they are."""
    normals, right = film.equations(start.weights)
    options, size = regularisation.options, right.shape[1]
    floor = _ROUNDING * max(float(np.trace(normals.mean(axis=0))) / size, 1e-300)
    terms = regularisation.added_to(np.zeros((size, size))) + floor * np.eye(size)
    bands = regularisation.bands(times) * (options.mode != "frame")
    return solve_by_frame(
        normals + terms,
        regularisation.pulled(right),
        bands,
        bounds,
        start,
        options.iterations,
        options.tolerance,
    )


def _gauss_newton(
    film: ProjectedTake,
    times: FloatArray,
    regularisation: Regularisation,
    bounds: Bounds,
    start: Iterate,
) -> Iterate:
    """Solve for the free weights of shapes with inbetweens or combinations."""
    bands = regularisation.bands(times) * (regularisation.options.mode != "frame")

    def cost(free: FloatArray) -> float:
        left = film.left(film.model.complete(free))
        own = 0.5 * float((left**2).sum()) + float(regularisation.value(free).sum())
        return own + 0.5 * roughness(bands, free)

    low, high = bounds.over(*start.weights.shape)
    here = replace(start, weights=np.clip(start.weights, low, high))
    value = cost(here.weights)
    for number in range(_STEPS):
        found = _one_step(film, times, regularisation, bounds, here)
        step = found.weights - here.weights
        size = 1.0
        # The first step may have to leave bounds that its start broke.
        for _ in range(_HALVINGS if number else 0):
            if cost(here.weights + size * step) <= value:
                break
            size *= 0.5
        here = replace(found, weights=here.weights + size * step)
        value = cost(here.weights)
        if size * float(np.abs(step).max(initial=0.0)) < regularisation.options.tolerance:
            break
    return here
