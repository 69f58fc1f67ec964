"""A take fitted to a face and solved: usable markers, neutral, places, space map, weights."""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.progress import Progress
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibrated_shapes import as_large, as_performed
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.film.projected_weights import solve_projected_weights
from usdface.retarget.film.views import Views
from usdface.retarget.marker_errors import (
    LARGE_ERROR,
    estimate_marker_errors,
    marker_error_findings,
)
from usdface.retarget.markers_beside import markers_beside
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.neutral_weights import (
    LARGEST,
    estimate_neutral_weights,
    neutral_weight_findings,
)
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.prepared_markers import PreparedMarkers, prepare_markers
from usdface.retarget.refined_fit import best_fit, refine_places
from usdface.retarget.shrinkage import restored_findings, restoring_factors
from usdface.retarget.solve_problem import SolveProblem
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget.take_gains import with_found_gains
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, visible

__all__ = ["FittedTake", "fit_take"]

# Frames of a trial, evenly spread, and rounds where it refines places: bounds on time. With 30
# rounds errors of the performers that the solve was built with are the same.
_TRIAL_FRAMES = 1000
_TRIAL_ROUNDS = 8


@dataclass(frozen=True, eq=False, slots=True)
class FittedTake:
    """A take fitted to a face and solved.

    Attributes
    ----------
    prepared : PreparedMarkers
    fit : FaceFit
    solved : PoseAndWeights
    setup : RetargetSetup
        Without head markers that do not determine a pose, and with the gains and the neutral
        weights that the take shows.
    factors : (S,) float64 [1]
        On the weights, of brows that the solve shrank.
    errors : (M,) float64 [1] or None
        Of the markers, by those around them; None = alike.
    """

    prepared: PreparedMarkers
    fit: FaceFit
    solved: PoseAndWeights
    setup: RetargetSetup
    factors: FloatArray
    errors: FloatArray | None

    def estimates(self, model: BlendShapeEvaluator) -> TakeEstimates:
        """Return the estimates that hold for all frames; `model` is of the performer's size."""
        found = self.solved.regularisation
        return TakeEstimates(
            markers=self.prepared.names,
            neutral=self.prepared.neutral,
            neutral_weights=dict(self.setup.neutral_weights),
            rest=self.fit.points,
            model=model,
            space=self.solved.space,
            marker_maps=self.fit.space.derivative,
            choice=self.fit.choice,
            shifts=self.fit.shifts,
            head=self.setup.head,
            head_markers=self.setup.head_markers,
            head_neutral=self.prepared.head_neutral,
            noise=found.noise,
            misfit=found.misfit,
            covariance=found.covariance,
            rounds=self.solved.rounds,
            factors=self.factors,
            errors=self.errors,
        )


@dataclass(frozen=True, eq=False, slots=True)
class _TakeSolver:
    """Solves the prepared markers of a take by fits of the performer's face.

    Attributes
    ----------
    times : (F,) float64 [s]
    prepared : PreparedMarkers
    shape_names : tuple of str, length S
    neutral_counts : (M,) int64 or None
        Frames that each marker's neutral is the mean of; None = its error is not corrected.
    views : Views or None
    progress : Progress or None
    some : (K,) int64
        Frames of a trial.
    """

    times: FloatArray
    prepared: PreparedMarkers
    shape_names: tuple[str, ...]
    neutral_counts: IntArray | None
    views: Views | None
    progress: Progress | None
    some: IntArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "some", _some_frames(visible(self.prepared.positions)))

    def solve(
        self,
        fit: FaceFit,
        setup: RetargetSetup,
        errors: FloatArray | None,
        pose: Pose | None = None,
    ) -> PoseAndWeights:
        """Solve the whole take; without a pose from the first guess."""
        return self._solved(
            fit, setup, pose or self.prepared.pose, slice(None), errors=errors,
            neutral_counts=self.neutral_counts, progress=self.progress,
        )  # fmt: skip

    def trial(self, fit: FaceFit, setup: RetargetSetup, **settings: Any) -> PoseAndWeights:
        """Solve some frames; no progress is announced."""
        return self._solved(fit, setup, self.prepared.pose, self.some, **settings)

    def _solved(
        self,
        fit: FaceFit,
        setup: RetargetSetup,
        pose: Pose,
        frames: IntArray | slice,
        errors: FloatArray | None = None,
        **settings: Any,
    ) -> PoseAndWeights:
        model, space = as_performed(fit, self.shape_names, setup)
        pose = pose.at(frames)
        problem = SolveProblem(
            times=self.times[frames],
            positions=self.prepared.positions[frames],
            target=fit.points,
            model=model,
            space=space,
            pose=pose,
            setup=setup,
            names=self.shape_names,
            least_noise=self.prepared.least_noise,
        )
        if self.views is not None:
            return solve_projected_weights(problem, self.views.at(frames))
        return solve_pose_and_weights(problem, errors=errors, **settings)


def fit_take(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    *,
    surface: MarkerSurface | None,
    views: Views | None = None,
    correct_neutral: bool = True,
    progress: Progress | None = None,
) -> tuple[FittedTake, list[Finding]]:
    """Fit a take to a face, refine the places of its markers, and solve it.

    Parameters, findings and errors are those of `usdface.retarget.solve_take.solve_take`.
    """
    shape_names = bound.shape_names

    def first_fit(
        setup: RetargetSetup,
    ) -> tuple[_TakeSolver, FaceFit, RetargetSetup, list[Finding]]:
        prepared, own, notes = prepare_markers(take, bound, setup, surface)
        counts = prepared.neutral_counts if correct_neutral else None
        seen = views and views.of(prepared.names)
        solver = _TakeSolver(take.times, prepared, shape_names, counts, seen, progress)
        fit, found = _fit(take, solver, own)
        return solver, fit, own, notes + found

    solver, fit, own, findings = first_fit(setup)
    shown, errors = _shown_and_errors(take, solver, fit, own, wanted=correct_neutral)
    if shown:
        solver, fit, own, findings = first_fit(replace(setup, neutral_weights=shown))
        findings += neutral_weight_findings(own, solver.prepared.model, shape_names, take.source)
        _, errors = _shown_and_errors(take, solver, fit, own, wanted=False)
    findings += marker_error_findings(errors, solver.prepared.names, take.source)
    solved = solver.solve(fit, own, errors)
    larger, notes = with_found_gains(own, fit, solved, shape_names, take, errors)
    if notes:
        solved = solver.solve(fit, larger, errors, solved.pose)
    factors = restoring_factors(larger, fit, solved, shape_names, take, surface)
    findings += notes + markers_beside(fit.shifts, fit.points, solver.prepared.names, take.source)
    findings += restored_findings(factors)
    return FittedTake(solver.prepared, fit, solved, larger, factors, errors), findings


def _shown_and_errors(
    take: MarkerTake, solver: _TakeSolver, fit: FaceFit, setup: RetargetSetup, *, wanted: bool
) -> tuple[dict[str, float], FloatArray | None]:
    """Return neutral weights by name and the markers' errors (M,) [1], by a trial of some frames.

    {} where neutral weights are not `wanted` or are given, None where the markers are alike.
    """
    options, names, is_paper = setup.solve, solver.shape_names, setup.map.form == "paper"
    given = setup.neutral is None or setup.neutral_weights or options.neutral == "given"
    known = given or not wanted
    alike = options.errors == "alike" or len(take.times) < FEWEST_FRAMES
    alike = alike or solver.views is not None  # which have the errors of a film
    if is_paper or (known and alike):
        return {}, None
    solved = solver.trial(fit, setup, rounds=_TRIAL_ROUNDS)
    model, _ = as_performed(fit, names, setup)
    times = take.times[solver.some]
    motion = MotionModel(fit.points, model, take.dimension, setup.head == "solve")
    errors, shown = None, {}
    if not alike:
        errors = estimate_marker_errors(
            times, solved.weights, solved.displaced, motion, solved.regularisation.variance
        )
    if not known:
        if errors is not None and (errors > LARGE_ERROR).any():
            # A slip would be taken for an expression of the neutral.
            solved = solver.trial(fit, setup, rounds=_TRIAL_ROUNDS, errors=errors)
        own = errors if solver.views is None else solver.views.errors
        found = estimate_neutral_weights(times, solved, motion, own)
        shown = _on_character(found, solver, setup)
    return shown, errors


def _on_character(shown: FloatArray, solver: _TakeSolver, setup: RetargetSetup) -> dict[str, float]:
    """Return neutral weights (S,) of the performer's blend shapes as those of the character's."""
    names, model = solver.shape_names, solver.prepared.model
    if setup.calibration is not None:
        # Offsets of a performer's file that have a weight in the neutral do not count.
        gains, offsets = setup.calibration.of(names)
        own = (gains * shown + offsets).clip(0.0, LARGEST)
        shown = np.where(shown > 0.0, own, 0.0)
    found = model.from_linear(shown[None])[0].round(3).tolist()
    free = {names[shape] for shape in model.free}
    return {n: w for n, w in zip(names, found, strict=True) if w > 0.0 and n in free}


def _fit(
    take: MarkerTake, solver: _TakeSolver, setup: RetargetSetup
) -> tuple[FaceFit, list[Finding]]:
    """Return the fit of the prepared markers that explains some frames of the take best."""
    prepared, names = solver.prepared, solver.shape_names
    evidence = prepared.evidence(take.times)
    fits = prepared.fits(setup, names, evidence, mapped=solver.views is None or solver.views.mapped)
    trial = partial(solver.trial, setup=setup)
    if prepared.surface is not None:
        refine = partial(
            refine_places, neutral=prepared.neutral, options=setup.map, evidence=evidence,
            surface=prepared.surface, solve=partial(trial, rounds=_TRIAL_ROUNDS),
            sized=partial(as_large, shape_names=names, setup=setup),
            moving_head=setup.head == "solve",
        )  # fmt: skip
        fits = tuple(refine(fit) for fit in fits)
    corrected = partial(trial, neutral_counts=solver.neutral_counts)
    fit, share = best_fit(fits, lambda fit: corrected(fit).regularisation.misfit)
    if share == 1.0:
        return fit, []
    message = (
        "the shapes of the performer's file are not used, its places and gains are: without the "
        "shapes {misfit_percent:.0f} % of the misfit of the markers is left"
    )
    return fit, [finding("PERFORMER_SHAPES_UNUSED", take.source, message, 100 * share)]


def _some_frames(is_visible: BoolArray) -> IntArray:
    """Return `_TRIAL_FRAMES` frames of a take, and some of each marker (F, M) that these hide."""
    frames = np.arange(0, len(is_visible), -(-len(is_visible) // _TRIAL_FRAMES))
    occluded = np.flatnonzero(~is_visible[frames].any(axis=0))
    others = [np.flatnonzero(is_visible[:, marker])[:FEWEST_FRAMES] for marker in occluded]
    return np.asarray(np.unique(np.concatenate([frames, *others])))
