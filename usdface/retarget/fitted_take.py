"""A take laid over a face and solved: usable markers, neutral, places, space map, weights."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.errors import InputError
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.options import AMPLITUDE_RANGE
from usdface.progress import Progress
from usdface.retarget.calibrated_shapes import as_large, as_performed, enlarged
from usdface.retarget.face_fit import FaceFit, fit_face, refine_places
from usdface.retarget.first_pose import first_pose
from usdface.retarget.loose_weights import held_peaks, loose_weights
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.neutral import neutral_markers, on_plane
from usdface.retarget.neutral_weights import without_weights
from usdface.retarget.performed_face import fit_known_face, wear
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.seen_weights import solve_seen_weights
from usdface.retarget.shrinkage import brow_factors, restored_findings
from usdface.retarget.solve import FEWEST_FRAMES
from usdface.retarget.take_amplitudes import take_amplitudes
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget.unseen_shapes import unseen_shapes, without_shapes
from usdface.retarget.usable_markers import (
    determined,
    neutral_frames,
    usable_markers,
)
from usdface.retarget.views import Views
from usdface.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, visible

__all__ = ["FittedTake", "fit_take"]

# Reported where a marker is this share of the face's size off: 1.5 mm on the ICT face.
_BESIDE = 0.025
# Frames that places are looked for in, evenly spread, and rounds of a solve: bounds on time. With
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
        """Return what the take says as a whole; `shapes` are those of the performer."""
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
    used, neutral, findings = usable_markers(take, points, setup)
    names = tuple(setup.binding.markers[i] for i in used)
    positions = take.select(names)
    basis = offsets[:, used]
    setup, notes = determined(setup, take, positions, basis)
    views = views.of(names) if views else None
    unseen = unseen_shapes(basis[..., : take.dimension])
    findings += notes + [finding("SHAPE_UNSEEN", shape_names[k]) for k in np.flatnonzero(unseen)]
    model = model or BlendShapeEvaluator(offsets.reshape(len(offsets), -1))
    model = model.select((3 * np.array(used)[:, None] + np.arange(3)).ravel())
    model = without_shapes(model, unseen)
    neutral = _without_neutral_weights(neutral, points[used], model, shape_names, take, setup)
    frames = neutral_frames(positions, setup)
    around = surface.select(np.array(used)) if surface and setup.solve.places == "found" else None
    face, worn = setup.calibration.face if setup.calibration else None, None
    if face and around is not None and take.dimension == 3:
        worn, notes = wear(face, names, around.vertices, neutral, frames, take.source)
        findings += notes
    if worn:
        neutral, frames = worn.neutral, worn.frames
    head_neutral = np.zeros((0, take.dimension))
    if setup.head == "markers":
        rigid = take.select(setup.head_markers)
        head_neutral = neutral_markers(rigid, setup.neutral or (0, 0))
    pose, pose_findings = first_pose(take, positions, neutral, setup, head_neutral)
    findings += pose_findings
    still = pose.to_head(on_plane(positions))[..., : take.dimension]
    evidence = MotionEvidence(take.times, still)
    if face and worn and around is not None:
        fit = fit_known_face(face, worn, shape_names, around)
    else:
        fit = fit_face(neutral, points[used], model, setup.map, evidence, around)

    least_noise = _least_noise(take, neutral, points[used])

    def solved(
        fit: FaceFit,
        frames: IntArray | slice = _ALL,
        setup: RetargetSetup = setup,
        pose: Pose = pose,
        **settings: Any,
    ) -> PoseAndWeights:
        model, space = as_performed(fit, shape_names, setup)
        if views is not None:
            return solve_seen_weights(
                take.times[frames], positions[frames], fit.points, model, space,
                Pose(pose.rotations[frames], pose.translations[frames]), setup, shape_names,
                views.at(frames), least_noise=least_noise,
            )  # fmt: skip
        return solve_pose_and_weights(
            take.times[frames], positions[frames], fit.points, model, space,
            Pose(pose.rotations[frames], pose.translations[frames]), setup, shape_names,
            least_noise=least_noise, progress=progress, **settings,
        )  # fmt: skip

    some = _some_frames(visible(positions))
    if around is not None:
        fit = refine_places(
            fit, neutral, setup.map, evidence, around,
            solve=lambda fit: solved(fit, some, rounds=_PLACE_ROUNDS),
            sized=lambda shapes: as_large(shapes, shape_names, setup),
            head_moves=setup.head == "solve",
        )  # fmt: skip
    noisy = frames if correct_neutral else None
    joint = solved(fit, neutral_frames=noisy)
    own, notes = _with_own_gains(setup, fit, joint, shape_names, take)
    if own is not setup:
        setup, joint = own, solved(fit, setup=own, pose=joint.pose, neutral_frames=noisy)
        findings += notes
    factors = _factors(setup, fit, joint, shape_names, take)
    findings += _beside(fit, names, take.source) + restored_findings(factors)
    return FittedTake(names, neutral, fit, joint, setup, head_neutral, factors), findings


def _least_noise(take: MarkerTake, neutral: FloatArray, points: FloatArray) -> float:
    """Return the take's deviation on the character [m]; 0 = unknown.

    Parameters
    ----------
    take : MarkerTake
    neutral : (M, D) float64
        Markers where they rest in the take.
    points : (M, 3) float64 [m]
        The same on the character.
    """
    if not take.deviation:
        return 0.0
    apart = rms_radius(neutral)
    if take.deviation >= apart:
        raise InputError(
            f"the deviation of the markers is {take.deviation:g}, more than they are apart "
            f"({apart:g}); expected that of a coordinate",
            "VALUES_WRONG",
        )
    return take.deviation * rms_radius(points[:, : take.dimension]) / apart


def _without_neutral_weights(
    neutral: FloatArray,
    target: FloatArray,
    model: BlendShapeEvaluator,
    shape_names: tuple[str, ...],
    take: MarkerTake,
    setup: RetargetSetup,
) -> FloatArray:
    if not setup.neutral_weights:
        return neutral
    if take.dimension == 2:
        raise InputError("a 2D take cannot have neutral weights", "TAKE_KIND_WRONG")
    unknown = sorted(setup.neutral_weights.keys() - set(shape_names))
    if unknown:
        raise InputError(
            f"a neutral weight is of {unknown[0]!r}, a blend shape the rig has not", "SHAPE_UNKNOWN"
        )
    weights = np.array([[setup.neutral_weights.get(name, 0.0) for name in shape_names]])
    shown = model.displacements(model.combined(weights)).reshape(target.shape)
    return without_weights(neutral, target, shown)


def _with_own_gains(
    setup: RetargetSetup,
    fit: FaceFit,
    joint: PoseAndWeights,
    shape_names: tuple[str, ...],
    take: MarkerTake,
) -> tuple[RetargetSetup, list[Finding]]:
    """Return the setup with the gains of movements that go beyond the character's; it, if none."""
    model, _ = as_performed(fit, shape_names, setup)
    wanted = setup.solve.gains == "found" and setup.map.form != "paper"
    # Weights beyond 1 are a straight continuation, which paths and combinations have not.
    if not (wanted and model.linear and take.dimension == 3 and len(take.times) >= FEWEST_FRAMES):
        return setup, []
    shown = model.displacements(joint.weights).reshape(joint.displaced.shape)
    loose, deviations = loose_weights(
        np.where(np.isnan(joint.displaced), shown, joint.displaced),
        fit.points,
        model.offsets[model.free].reshape(-1, *fit.points.shape),
        take.times,
        joint.regularisation,
        moving_head=setup.head == "solve",
        within=(0.0, AMPLITUDE_RANGE[1]),
    )
    gains = take_amplitudes(held_peaks(loose, take.times), deviations)
    beyond = np.flatnonzero(gains > 1.0)
    if not len(beyond):
        return setup, []
    names = tuple(shape_names[shape] for shape in model.free)
    message = (
        "movements go beyond the character's, {shape} {gain:.2f} times as far; they are taken to "
        "be larger in the whole take: {shapes}"
    )
    most = int(gains.argmax())
    shapes = [names[shape] for shape in beyond]
    found = finding("GAIN_FOUND", take.source, message, names[most], gains[most], shapes)
    return replace(setup, calibration=enlarged(setup.calibration, names, gains)), [found]


def _factors(
    setup: RetargetSetup,
    fit: FaceFit,
    joint: PoseAndWeights,
    shape_names: tuple[str, ...],
    take: MarkerTake,
) -> FloatArray:
    """Return the factors on the weights (S,) of brows that the solve shrank.

    1 of an image, which does not see how far brows come forward.
    """
    wanted = setup.solve.shrinkage == "restored" and setup.map.form != "paper"
    if not wanted or take.dimension == 2 or len(take.times) < FEWEST_FRAMES:
        return np.ones(len(shape_names))
    model, _ = as_performed(fit, shape_names, setup)
    moving = setup.head == "solve"
    return brow_factors(
        joint.weights, take.times, joint.displaced, fit.points, model, shape_names,
        moving_head=moving,
    )  # fmt: skip


def _some_frames(seen: BoolArray) -> IntArray:
    """Return `_PLACE_FRAMES` frames of a take, and some of each marker (F, M) that these hide."""
    frames = np.arange(0, len(seen), -(-len(seen) // _PLACE_FRAMES))
    hidden = np.flatnonzero(~seen[frames].any(axis=0))
    more = [np.flatnonzero(seen[:, marker])[:FEWEST_FRAMES] for marker in hidden]
    return np.asarray(np.unique(np.concatenate([frames, *more])))


def _beside(fit: FaceFit, names: tuple[str, ...], source: str) -> list[Finding]:
    """Report markers that the solve takes to be beside their vertices."""
    away = np.linalg.norm(fit.shifts, axis=1)
    farthest = int(away.argmax())
    if away[farthest] < _BESIDE * rms_radius(fit.points):
        return []
    message = (
        "markers sit {median_mm:.1f} mm from their vertices in the median, {marker} "
        "{largest_mm:.1f} mm; the solve reckons with that. The shot keeps the vertices; "
        'solve:places = "bound" holds markers on them'
    )
    return [
        finding(
            "MARKER_BESIDE",
            source,
            message,
            1000 * np.median(away),
            names[farthest],
            1000 * away[farthest],
        )
    ]
