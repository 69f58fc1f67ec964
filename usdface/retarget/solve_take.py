"""Solve of a marker take: usable markers, neutral, space map, weights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.errors import InputError
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.progress import Progress
from usdface.retarget.calibrated_shapes import as_performed
from usdface.retarget.face_fit import FaceFit, fit_face, refine_places
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.neutral import neutral_markers, on_plane
from usdface.retarget.neutral_weights import without_weights
from usdface.retarget.performed_face import fit_known_face, wear
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.solution import Solution
from usdface.retarget.solve import FEWEST_FRAMES
from usdface.retarget.take_estimates import TakeEstimates
from usdface.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = [
    "estimate_take",
    "first_pose",
    "head_markers_few",
    "occlusions",
    "solution_of",
    "solve_take",
    "unsolved_frames",
]

# Markers are in a line if they reach no further to the side than this share of its length: 1 mm of
# 50, where noise of 0.3 mm would turn the head by 17 degrees.
_IN_LINE = 0.02
# Reported where a marker is this share of the face's size off: 1.5 mm on the ICT face.
_BESIDE = 0.025
# Frames that places are looked for in, evenly spread, and rounds of a solve: bounds on time. With
# 30 rounds errors of the performers that the solve was built with are the same.
_PLACE_FRAMES = 1000
_PLACE_ROUNDS = 8
_ALL = slice(None)


def solve_take(
    take: MarkerTake,
    points: FloatArray,
    offsets: FloatArray,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
    model: BlendShapeEvaluator | None = None,
    *,
    surface: MarkerSurface | None = None,
    correct_neutral: bool = True,
    progress: Progress | None = None,
) -> tuple[Solution, list[Finding]]:
    """Retarget a marker take onto a face.

    Parameters
    ----------
    take : MarkerTake
    points : (B, 3) float64 [m]
        Neutral positions on the character of the B markers of `setup.binding`.
    offsets : (S, B, 3) float64 [m]
        Their offset by each blend shape at weight 1.
    shape_names : tuple of str, length S
    setup : RetargetSetup
    model : BlendShapeEvaluator, optional
        Of all B markers' displacements, inbetweens and combinations included; linear, if left
        out.
    surface : MarkerSurface, optional
        The skin around the B vertices: markers may sit beside them.
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
    fitted, findings = _fitted(
        take, points, offsets, shape_names, setup, model,
        surface=surface, correct_neutral=correct_neutral, progress=progress,
    )  # fmt: skip
    shapes, _ = as_performed(fitted.fit, shape_names, setup)
    findings += unsolved_frames(visible(fitted.joint.displaced), take.source)
    return solution_of(take, fitted.joint, fitted.estimates(shapes), shape_names), findings


def estimate_take(
    take: MarkerTake,
    points: FloatArray,
    offsets: FloatArray,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
    model: BlendShapeEvaluator,
    *,
    surface: MarkerSurface,
    progress: Progress | None = None,
) -> tuple[TakeEstimates, list[Finding]]:
    """Return all that `solve_take` finds in a take but what it finds in each frame.

    Parameters, findings and errors are those of `solve_take`.
    """
    fitted, findings = _fitted(
        take, points, offsets, shape_names, setup, model, surface=surface, progress=progress
    )
    shapes, _ = as_performed(fitted.fit, shape_names, setup)
    return fitted.estimates(shapes), findings


@dataclass(frozen=True, eq=False, slots=True)
class _Fitted:
    """A take laid over a face and solved.

    Attributes
    ----------
    names : tuple of str, length M
        The markers that are used.
    neutral : (M, D) float64
    fit : FaceFit
    joint : PoseAndWeights
    setup : RetargetSetup
        Without head markers that do not determine a pose.
    head_neutral : (H, D) float64
        Where the head markers rest.
    """

    names: tuple[str, ...]
    neutral: FloatArray
    fit: FaceFit
    joint: PoseAndWeights
    setup: RetargetSetup
    head_neutral: FloatArray

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
        )


def _fitted(
    take: MarkerTake,
    points: FloatArray,
    offsets: FloatArray,
    shape_names: tuple[str, ...],
    setup: RetargetSetup,
    model: BlendShapeEvaluator | None,
    *,
    surface: MarkerSurface | None,
    correct_neutral: bool = True,
    progress: Progress | None = None,
) -> tuple[_Fitted, list[Finding]]:
    used, neutral, findings = _usable_markers(take, points, setup)
    names = tuple(setup.binding.markers[i] for i in used)
    positions = take.select(names)
    basis = offsets[:, used]
    setup, notes = _determined(setup, take, positions, basis)
    findings += notes + _unseen_shapes(basis[..., : take.dimension], shape_names)
    model = model or BlendShapeEvaluator(offsets.reshape(len(offsets), -1))
    model = model.select((3 * np.array(used)[:, None] + np.arange(3)).ravel())
    neutral = _without_weights(neutral, points[used], model, shape_names, take, setup)
    frames = _neutral_frames(positions, setup)
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

    def solved(fit: FaceFit, frames: IntArray | slice = _ALL, **settings: Any) -> PoseAndWeights:
        model, space = as_performed(fit, shape_names, setup)
        return solve_pose_and_weights(
            take.times[frames], positions[frames], fit.points, model, space,
            Pose(pose.rotations[frames], pose.translations[frames]), setup, shape_names,
            progress=progress, **settings,
        )  # fmt: skip

    some = _some_frames(visible(positions))
    if around is not None:
        fit = refine_places(
            fit, neutral, setup.map, evidence, around,
            solve=lambda fit: solved(fit, some, rounds=_PLACE_ROUNDS),
            head_moves=setup.head == "solve",
        )  # fmt: skip
    joint = solved(fit, neutral_frames=frames if correct_neutral else None)
    findings += _beside(fit, names, take.source)
    return _Fitted(names, neutral, fit, joint, setup, head_neutral), findings


def solution_of(
    take: MarkerTake,
    joint: PoseAndWeights,
    learned: TakeEstimates,
    shape_names: tuple[str, ...],
) -> Solution:
    """Return the solution of a take, with its residuals on the character."""
    weights, displaced = joint.weights, joint.displaced
    predicted = learned.shapes.displacements(weights).reshape(displaced.shape)
    hidden = np.isnan(displaced)
    misfit = np.where(hidden, 0.0, displaced - predicted)
    if take.dimension == 2:
        misfit[..., 2] = 0.0
    seen = visible(displaced)
    squares = (misfit**2).sum(axis=2)
    return Solution(
        WeightsTake(shape_names, take.times, weights, take.rate, take.start_timecode, take.source),
        joint.pose,
        np.sqrt(squares.sum(axis=1) / np.maximum(seen.sum(axis=1), 1)),
        learned.points + np.where(hidden, predicted, displaced),
        learned.points,
        learned.markers,
        learned.neutral,
        learned.noise,
        learned.misfit,
        joint.rounds,
        learned.choice,
        np.where(seen, np.sqrt(squares), np.nan),
        in_space=take.dimension == 3,
        covariance=learned.covariance,
        shifts=learned.shifts,
        model=learned.shapes,
        carried=learned.carried,
    )


def _usable_markers(
    take: MarkerTake, points: FloatArray, setup: RetargetSetup
) -> tuple[list[int], FloatArray, list[Finding]]:
    """Return the usable bound markers, their neutral, and findings on the others."""
    binding, findings = setup.binding, []
    known = [i for i, name in enumerate(binding.markers) if name in take.names]
    for name in sorted(set(binding.markers) - set(take.names)):
        findings.append(finding("MARKER_UNKNOWN", name, "the take has no marker {marker!r}", name))
    unbound = [name for name in take.names if name not in binding.markers]
    if unbound:
        findings.append(finding("MARKER_UNBOUND", take.source, "not bound: {markers}", unbound))
    if not known:
        raise InputError(
            f"none of the {len(binding.markers)} bound markers is in the take "
            f"{take.source}; bound: {', '.join(binding.markers[:6])}, ...; "
            f"in the take: {', '.join(take.names[:6])}, ...",
            "MARKER_UNKNOWN",
        )
    positions = take.select(tuple(binding.markers[i] for i in known))
    if setup.neutral is None:
        if take.dimension == 2:
            raise InputError(
                'a 2D take cannot have the neutral "rig"; name neutral frames', "TAKE_KIND_WRONG"
            )
        neutral = points[known]
    else:
        neutral = neutral_markers(positions, setup.neutral)
    ever = np.asarray(visible(positions).any(axis=0))
    resting = visible(neutral)
    for i, name in enumerate(binding.markers[k] for k in known):
        if not ever[i]:
            findings.append(finding("MARKER_NEVER_SEEN", name))
        elif not resting[i]:
            findings.append(finding("MARKER_WITHOUT_NEUTRAL", name))
    keep = np.flatnonzero(ever & resting)
    if len(keep) < 4:
        raise InputError(
            f"only {len(keep)} bound markers are visible in the neutral frames of "
            f"{take.source}; at least 4 are needed. Name other neutral frames or bind more",
            "MARKERS_TOO_FEW",
        )
    hidden = np.isnan(positions[:, keep, 0]).sum(axis=0)
    used = [known[k] for k in keep]
    findings += occlusions([binding.markers[k] for k in used], hidden, len(positions))
    return used, neutral[keep], findings


def occlusions(names: Sequence[str], hidden: IntArray, frames: int) -> list[Finding]:
    """Report the markers that are hidden in some of the frames, by how many (M,)."""
    message = "hidden in {occluded_count} of {frame_count} frames"
    return [
        finding("MARKER_OCCLUDED", name, message, count, frames)
        for name, count in zip(names, hidden.tolist(), strict=True)
        if count
    ]


def _without_weights(
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


def _neutral_frames(positions: FloatArray, setup: RetargetSetup) -> IntArray | None:
    """Return the frames that each marker's neutral is the mean of: (M,); None for the rig's own."""
    if setup.neutral is None:
        return None
    first, last = setup.neutral
    return np.asarray(visible(positions[first : last + 1]).sum(axis=0))


def _determined(
    setup: RetargetSetup, take: MarkerTake, positions: FloatArray, basis: FloatArray
) -> tuple[RetargetSetup, list[Finding]]:
    """Report degrees of freedom that the markers leave open; drop head markers in a line."""
    findings = []
    if setup.head == "markers":
        rigid = on_plane(take.select(setup.head_markers))
        rest = neutral_markers(rigid, setup.neutral or (0, 0))
        rest = rest[visible(rest)]
        extent = np.linalg.svd(rest - rest.mean(axis=0), compute_uv=False) if len(rest) else [0.0]
        if len(extent) < 2 or extent[1] <= _IN_LINE * extent[0]:
            where = ", ".join(setup.head_markers)
            findings.append(finding("HEAD_MARKERS_IN_LINE", where))
            setup = replace(setup, head="solve", head_markers=())
    moved = np.abs(basis).max(axis=(1, 2))
    shapes = int((moved > 1e-9 * moved.max(initial=0.0)).sum())
    known = take.dimension * basis.shape[1] - (6 if setup.head == "solve" else 0)
    if known < shapes:
        message = (
            "{marker_count} markers say {known_count} numbers of the face for {shape_count} "
            "blend shapes; what they leave open stays as small as can be. Bind more markers"
        )
        findings.append(
            finding("MARKERS_FEW", take.source, message, basis.shape[1], max(known, 0), shapes)
        )
    span = np.nanmax(positions, axis=0) - np.nanmin(positions, axis=0)
    if len(positions) > 1 and not span.any():
        findings.append(finding("TAKE_STILL", take.source))
    return setup, findings


def _unseen_shapes(basis: FloatArray, names: tuple[str, ...]) -> list[Finding]:
    moved = np.abs(basis).max(axis=(1, 2))
    return [
        finding("SHAPE_UNSEEN", name)
        for name, size in zip(names, moved, strict=True)
        if size <= 1e-9 * moved.max()
    ]


def unsolved_frames(seen: BoolArray, source: str) -> list[Finding]:
    """Report frames in which no marker (F, M) was seen."""
    empty = np.flatnonzero(~seen.any(axis=1))
    if not len(empty):
        return []
    message = (
        "no bound marker is visible in {unsolved_count} of {frame_count} frames, the "
        "first of them frame {first_frame}; they follow their neighbours"
    )
    return [finding("FRAME_UNSOLVED", source, message, len(empty), len(seen), empty[0])]


def first_pose(
    take: MarkerTake,
    positions: FloatArray,
    neutral: FloatArray,
    setup: RetargetSetup,
    head_neutral: FloatArray,
) -> tuple[Pose, list[Finding]]:
    """Return the head's pose before the solve: a rigid fit, or that of the head markers.

    Parameters
    ----------
    take : MarkerTake
    positions : (F, M, D) float64
        Of the markers that are used.
    neutral : (M, D) float64
    setup : RetargetSetup
    head_neutral : (H, D) float64
        Where its head markers rest.
    """
    if setup.head == "stabilised":
        return Pose.identity(len(positions)), []
    if setup.head == "solve":
        pose, usable = rigid_fit(on_plane(neutral), on_plane(positions))
    else:
        rigid = take.select(setup.head_markers)
        pose, usable = rigid_fit(on_plane(head_neutral), on_plane(rigid))
    return pose, head_markers_few(usable, take.source)


def head_markers_few(usable: BoolArray, source: str) -> list[Finding]:
    """Report frames (F,) in which too few markers show the head's pose."""
    if usable.all():
        return []
    missing = int((~usable).sum())
    return [
        finding(
            "HEAD_MARKERS_FEW",
            source,
            "fewer than three head markers in {few_count} of {frame_count} frames; the head "
            "keeps the pose of the nearest frame there",
            missing,
            len(usable),
        )
    ]
