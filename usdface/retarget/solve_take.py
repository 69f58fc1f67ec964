"""Solve of a marker take, and the solution with its residuals."""

import numpy as np

from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding
from usdface.progress import Progress
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibrated_shapes import as_performed
from usdface.retarget.film.views import Views
from usdface.retarget.fitted_take import fit_take
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.shrinkage import restored
from usdface.retarget.solution import Solution
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget.usable_markers import unsolved_frames
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = ["estimate_take", "solution_of", "solve_take"]


def solve_take(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    *,
    surface: MarkerSurface | None = None,
    views: Views | None = None,
    correct_neutral: bool = True,
    progress: Progress | None = None,
) -> tuple[Solution, list[Finding]]:
    """Retarget a marker take onto a face.

    Parameters
    ----------
    take : MarkerTake
    bound : BoundPoints
        The B markers of `setup.binding` on the character.
    setup : RetargetSetup
    surface : MarkerSurface, optional
        The skin around the B vertices: markers may sit beside them.
    views : Views, optional
        Of a take as one camera sees it (`usdface.retarget.film.filmed_head.FilmedHead.projected`).
    correct_neutral : bool
        Correct the error of noisy neutral frames by the whole take.
    progress : Progress, optional
        Announces each round of the step "solve".

    Returns
    -------
    Solution
    list of Finding

    Raises
    ------
    InputError
        If the binding or the neutral frames do not fit the take.
    SolveError
        If the bound markers do not determine an answer.
    """
    fitted, findings = fit_take(
        take, bound, setup,
        surface=surface, views=views, correct_neutral=correct_neutral, progress=progress,
    )  # fmt: skip
    model, _ = as_performed(fitted.fit, bound.shape_names, fitted.setup)
    findings += unsolved_frames(visible(fitted.solved.displaced), take.source)
    return solution_of(
        take, fitted.solved, fitted.estimates(model), bound.shape_names, setup.pins
    ), findings


def estimate_take(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    *,
    surface: MarkerSurface,
) -> tuple[TakeEstimates, list[Finding]]:
    """Return the estimates of `solve_take` that hold for all frames of a take.

    Parameters, findings and errors are those of `solve_take`.
    """
    fitted, findings = fit_take(take, bound, setup, surface=surface)
    model, _ = as_performed(fitted.fit, bound.shape_names, fitted.setup)
    return fitted.estimates(model), findings


def solution_of(
    take: MarkerTake,
    solved: PoseAndWeights,
    learned: TakeEstimates,
    shape_names: tuple[str, ...],
    pins: tuple[Pin, ...],
) -> Solution:
    """Return the solution of a take, with its residuals on the character."""
    displaced, model = solved.displaced, learned.model
    weights = restored(solved.weights, take.times, learned.factors, model, shape_names, pins)
    predicted = model.displacements(weights).reshape(displaced.shape)
    occluded = np.isnan(displaced)
    misfit = np.where(occluded, 0.0, displaced - predicted)
    if take.dimension == 2:
        misfit[..., 2] = 0.0
    is_visible = visible(displaced)
    squares = (misfit**2).sum(axis=2)
    names, times = shape_names, take.times
    return Solution(
        weights=WeightsTake(names, times, weights, take.rate, take.start_timecode, take.source),
        pose=solved.pose,
        residual=np.sqrt(squares.sum(axis=1) / np.maximum(is_visible.sum(axis=1), 1)),
        feature_points=learned.rest + np.where(occluded, predicted, displaced),
        rest=learned.rest,
        markers=learned.markers,
        neutral=learned.neutral,
        noise=learned.noise,
        misfit=learned.misfit,
        rounds=solved.rounds,
        choice=learned.choice,
        distances=np.where(is_visible, np.sqrt(squares), np.nan),
        shifts=learned.shifts,
        model=learned.model,
        marker_maps=learned.marker_maps,
        head=learned.head,
        neutral_weights=learned.neutral_weights,
        covariance=learned.covariance,
        errors=learned.errors,
    )
