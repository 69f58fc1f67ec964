"""The markers of a take before it is solved: usable ones, their neutral, the head pose."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.errors import InputError
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.face_fit import FaceFit, fit_at_places, fit_face, fit_in_head_space
from usdface.retarget.film.unseen_shapes import unseen_shapes, without_shapes
from usdface.retarget.first_pose import first_pose, head_markers_few, in_posed_frames
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.neutral import neutral_markers, on_plane
from usdface.retarget.neutral_weights import without_weights
from usdface.retarget.performed_face import (
    MatchedFace,
    fit_known_face,
    known_places,
    match_face,
)
from usdface.retarget.usable_markers import determined, neutral_counts, usable_markers
from usdface.setup.retarget_setup import RetargetSetup, check_neutral_weights
from usdface.takes import MarkerTake

__all__ = ["PreparedMarkers", "prepare_markers"]


@dataclass(frozen=True, eq=False, slots=True)
class PreparedMarkers:
    """The usable markers of a take, and their state before a solve.

    Attributes
    ----------
    names : tuple of str, length M
    positions : (F, M, D) float64
        NaN where occluded, and where the head's pose is unknown.
    neutral : (M, D) float64
    neutral_counts : (M,) int64 or None
        Of the frames that `neutral` is the mean of; None = exact.
    points : (M, 3) float64 [m]
        Vertices on the character.
    model : BlendShapeEvaluator
        Of their displacements, without blend shapes that this take cannot determine.
    surface : MarkerSurface or None
        The skin around them; None = they are held on their vertices.
    matched : MatchedFace or None
        The performer's face as far as it is known.
    pose : Pose
        A first guess, or the head's pose where it is known.
    head_neutral : (H, D) float64
        Where the head markers rest.
    least_noise : float [m]
        Deviation of a coordinate on the character that the take states; 0 = unknown.
    """

    names: tuple[str, ...]
    positions: FloatArray
    neutral: FloatArray
    neutral_counts: IntArray | None
    points: FloatArray
    model: BlendShapeEvaluator
    surface: MarkerSurface | None
    matched: MatchedFace | None
    pose: Pose
    head_neutral: FloatArray
    least_noise: float

    def evidence(self, times: FloatArray) -> MotionEvidence:
        """Return the motion of the markers in the head, at times (F,) [s]."""
        dimension = self.positions.shape[2]
        return MotionEvidence(times, self.pose.to_head(on_plane(self.positions))[..., :dimension])

    def fits(
        self,
        setup: RetargetSetup,
        shape_names: tuple[str, ...],
        evidence: MotionEvidence,
        *,
        mapped: bool,
    ) -> tuple[FaceFit, ...]:
        """Return fits of the performer's face to the character's, before places are refined.

        A performer whose face is known is fitted by all of it, and by the known places alone. Of
        one who is aligned with the character already, displacements are not `mapped`.
        """
        given = setup.map
        if not mapped:
            return (fit_in_head_space(self.neutral, self.points, self.model),)
        if self.matched is None:
            return (fit_face(self.neutral, self.points, self.model, given, evidence, self.surface),)
        known = fit_known_face(self.matched, shape_names)
        guess = known_places(self.matched, self.points)
        if guess is None or given.form == "paper":
            return (known,)
        return known, fit_at_places(self.neutral, guess, given, evidence, self.matched.surface)


def prepare_markers(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    surface: MarkerSurface | None,
) -> tuple[PreparedMarkers, RetargetSetup, list[Finding]]:
    """Return the usable markers, and the setup without head markers that determine no pose.

    Parameters, findings and errors are those of `usdface.retarget.solve_take.solve_take`.
    """
    used, neutral, findings = usable_markers(take, bound.rest, setup)
    names = tuple(setup.binding.markers[i] for i in used)
    positions, own = take.select(names), bound.select(np.array(used))
    setup, notes = determined(setup, take, positions, own.offsets)
    unseen = unseen_shapes(own.offsets[..., : take.dimension])
    findings += notes + [
        finding("SHAPE_UNSEEN", own.shape_names[k]) for k in np.flatnonzero(unseen)
    ]
    points, model = own.rest, without_shapes(own.model, unseen)
    neutral = _without_neutral_weights(neutral, points, model, own.shape_names, setup)
    counts = neutral_counts(positions, setup)
    around = surface.select(np.array(used)) if surface and setup.solve.places == "found" else None
    face, matched = setup.calibration.face if setup.calibration else None, None
    if face and around is not None and take.dimension == 3:
        matched, notes = match_face(face, names, around, neutral, counts, take.source)
        findings += notes
    if matched:
        neutral, counts = matched.neutral, matched.frames
    head_neutral = np.zeros((0, take.dimension))
    if setup.head == "markers":
        head_neutral = neutral_markers(take.select(setup.head_markers), setup.neutral or (0, 0))
    pose, posed = first_pose(take, positions, neutral, setup, head_neutral)
    positions = in_posed_frames(positions, posed)
    prepared = PreparedMarkers(
        names, positions, neutral, counts, points, model, around, matched, pose, head_neutral,
        _least_noise(take, neutral, points),
    )  # fmt: skip
    return prepared, setup, findings + head_markers_few(posed, take.source)


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
    setup: RetargetSetup,
) -> FloatArray:
    if not setup.neutral_weights:
        return neutral
    check_neutral_weights(setup.neutral_weights, shape_names)
    weights = np.array([[setup.neutral_weights.get(name, 0.0) for name in shape_names]])
    shown = model.displacements(model.combined(weights)).reshape(target.shape)
    return without_weights(neutral, target, shown)
