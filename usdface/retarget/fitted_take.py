"""A take laid over a face and solved: usable markers, neutral, places, space map, weights."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.progress import Progress
from usdface.retarget.calibrated_shapes import as_large, as_performed
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.film.projected_weights import solve_projected_weights
from usdface.retarget.film.views import Views
from usdface.retarget.laid_markers import LaidMarkers, lay_markers
from usdface.retarget.markers_beside import markers_beside
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.refined_fit import best_fit, refine_places
from usdface.retarget.shrinkage import restored_findings, restoring_factors
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.retarget.take_amplitudes import with_found_gains
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, visible

__all__ = ["FittedTake", "fit_take"]

# Frames sampled to refine places, evenly spread, and rounds of a solve: bounds on time. With
# 30 rounds errors of the performers that the solve was built with are the same.
_PLACE_FRAMES = 1000
_PLACE_ROUNDS = 8
_ALL = slice(None)


@dataclass(frozen=True, eq=False, slots=True)
class FittedTake:
    """A take laid over a face and solved.

    Attributes
    ----------
    names : tuple of str, length M
        The markers that are used.
    neutral : (M, D) float64
    fit : FaceFit
    joint : PoseAndWeights
    setup : RetargetSetup
        Without head markers that do not determine a pose, and with the gains that the take shows.
    head_neutral : (H, D) float64
        Where the head markers rest.
    factors : (S,) float64 [1]
        On the weights, of brows that the solve shrank.
    """

    names: tuple[str, ...]
    neutral: FloatArray
    fit: FaceFit
    joint: PoseAndWeights
    setup: RetargetSetup
    head_neutral: FloatArray
    factors: FloatArray

    def estimates(self, shapes: BlendShapeEvaluator) -> TakeEstimates:
        """Return the estimates that hold for all frames; `shapes` are those of the performer."""
        found = self.joint.regularisation
        return TakeEstimates(
            self.names,
            self.neutral,
            self.fit.points,
            shapes,
            self.joint.space,
            self.fit.space.derivative,
            self.fit.choice,
            self.fit.shifts,
            self.setup.head,
            self.head_neutral,
            found.noise,
            found.misfit,
            found.covariance,
            self.joint.rounds,
            self.factors,
        )


@dataclass(frozen=True, eq=False, slots=True)
class _TakeSolver:
    """Solves the laid markers of a take by fits of the performer's face."""

    times: FloatArray
    laid: LaidMarkers
    shape_names: tuple[str, ...]
    views: Views | None
    progress: Progress | None

    def solve(
        self,
        fit: FaceFit,
        setup: RetargetSetup,
        pose: Pose,
        frames: IntArray | slice = _ALL,
        **settings: Any,
    ) -> PoseAndWeights:
        model, space = as_performed(fit, self.shape_names, setup)
        pose = Pose(pose.rotations[frames], pose.translations[frames])
        times, positions = self.times[frames], self.laid.positions[frames]
        noise = self.laid.least_noise
        if self.views is not None:
            return solve_projected_weights(
                times, positions, fit.points, model, space, pose, setup, self.shape_names,
                self.views.at(frames), least_noise=noise,
            )  # fmt: skip
        return solve_pose_and_weights(
            times, positions, fit.points, model, space, pose, setup, self.shape_names,
            least_noise=noise, progress=self.progress, **settings,
        )  # fmt: skip


def fit_take(
    take: MarkerTake,
    points: FloatArray,
    offsets: FloatArray,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
    model: BlendShapeEvaluator | None,
    *,
    surface: MarkerSurface | None,
    views: Views | None = None,
    correct_neutral: bool = True,
    progress: Progress | None = None,
) -> tuple[FittedTake, list[Finding]]:
    """Lay a take over a face, refine the places of its markers, and solve it.

    Parameters, findings and errors are those of `usdface.retarget.solve_take.solve_take`.
    """
    laid, setup, findings = lay_markers(take, points, offsets, shape_names, setup, model, surface)
    solver = _TakeSolver(
        take.times, laid, shape_names, views.of(laid.names) if views else None, progress
    )
    noisy = laid.frames if correct_neutral else None
    fit, notes = _fit(take, solver, setup, noisy)
    findings += notes
    joint = solver.solve(fit, setup, laid.pose, neutral_frames=noisy)
    own, notes = with_found_gains(setup, fit, joint, shape_names, take)
    if notes:
        joint = solver.solve(fit, own, joint.pose, neutral_frames=noisy)
    factors = restoring_factors(own, fit, joint, shape_names, take, surface)
    findings += notes + markers_beside(fit.shifts, fit.points, laid.names, take.source)
    findings += restored_findings(factors)
    return FittedTake(
        laid.names, laid.neutral, fit, joint, own, laid.head_neutral, factors
    ), findings


def _fit(
    take: MarkerTake, solver: _TakeSolver, setup: RetargetSetup, noisy: IntArray | None
) -> tuple[FaceFit, list[Finding]]:
    """Return the fit of the laid markers that explains some frames of the take best."""
    laid, names = solver.laid, solver.shape_names
    evidence = laid.evidence(take.times)
    fits = laid.fits(setup, names, evidence)
    some = _some_frames(visible(laid.positions))
    trial = partial(solver.solve, setup=setup, pose=laid.pose, frames=some)
    if laid.surface is not None:
        refine = partial(
            refine_places, neutral=laid.neutral, options=setup.map, evidence=evidence,
            surface=laid.surface, solve=partial(trial, rounds=_PLACE_ROUNDS),
            sized=partial(as_large, shape_names=names, setup=setup),
            head_moves=setup.head == "solve",
        )  # fmt: skip
        fits = tuple(refine(fit) for fit in fits)
    fit, share = best_fit(fits, lambda fit: trial(fit, neutral_frames=noisy).regularisation.misfit)
    if share == 1.0:
        return fit, []
    message = "the places of the markers alone leave {misfit_percent:.0f} % of its misfit"
    return fit, [finding("PERFORMER_SHAPES_UNUSED", take.source, message, 100 * share)]


def _some_frames(is_visible: BoolArray) -> IntArray:
    """Return `_PLACE_FRAMES` frames of a take, and some of each marker (F, M) that these hide."""
    frames = np.arange(0, len(is_visible), -(-len(is_visible) // _PLACE_FRAMES))
    hidden = np.flatnonzero(~is_visible[frames].any(axis=0))
    others = [np.flatnonzero(is_visible[:, marker])[:FEWEST_FRAMES] for marker in hidden]
    return np.asarray(np.unique(np.concatenate([frames, *others])))
