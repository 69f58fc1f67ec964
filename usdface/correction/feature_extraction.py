"""Feature extraction: the inputs of a fuzzy system, of the whole face and of either half."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.features import MILLIMETRE, face_unit, measure, smooth
from usdface.correction.likeness import ExpressionLikeness, Likeness
from usdface.correction.shown_motion import motion_gains
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import SIDES, Side, half_face, half_weights, midline, sides_of
from usdface.face.symmetry import symmetric_pairs
from usdface.options import MARKER_NOISE
from usdface.retarget.neutral import on_plane
from usdface.retarget.solution import Solution
from usdface.retarget_setup import Expression
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Features", "features", "sided_features"]


# Width of the Gaussian [s] over which motion is compared; as the features' own.
_GAIN_WIDTH = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class Features:
    """The inputs of a fuzzy system, measured on a face.

    Attributes
    ----------
    sides : mapping of "both", "left", "right" to (F, I) float64
        Of the whole face, and of each half mirrored to the other side.
    markers : tuple of str, length I
        The marker that each input reads.
    unit : float [m]
        The length that inputs are divided by.
    likeness : mapping of "both", "left", "right" to Likeness
        How far the motion of each side is that of the expressions; empty where only rules count.
    """

    sides: Mapping[Side, FloatArray]
    markers: tuple[str, ...] = ()
    unit: float = MILLIMETRE
    likeness: Mapping[Side, Likeness] = field(default_factory=dict)


# Names of markers, their neutral positions (M, 3), and their positions (F, M, 3) for each side.
_SidedMarkers = tuple[tuple[str, ...], FloatArray, dict[Side, FloatArray]]


def features(
    system: ExpressionSystem,
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    *,
    weights: WeightsTake,
    solution: Solution | None,
) -> FloatArray:
    """Measure the inputs in the system's space, smoothed in proportion to the noise: (F, I).

    Weights are matched to the mesh's blend shapes by name; others are ignored.

    Raises
    ------
    InputError
        If the space is the take's and the take has no markers, or the system reads a marker
        that is not there.
    """
    extracted = sided_features(
        system, face, take, weights=weights, solution=solution, sides=("both",)
    )
    return extracted.sides["both"]


def sided_features(
    system: ExpressionSystem,
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    *,
    weights: WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side] = SIDES,
    expressions: Sequence[Expression] = (),
) -> Features:
    """Measure the inputs of the whole face and of each half, mirrored to the other side.

    With `expressions` their likeness is judged, too, if the system asks for it. Raises as
    `features`.
    """
    if system.space == "take":
        names, neutral, by_side = _take_markers(face, take, solution, sides)
    else:
        names, neutral, by_side = _character_markers(face, weights, solution, sides)
    _check_roles(system, names, face.roles)
    unit = face_unit(system, neutral)
    # As in the solve: a take without noise is not smoothed.
    noise = min(solution.noise / MARKER_NOISE, 1.0) if solution else 0.0
    inputs: dict[Side, FloatArray] = {}
    likeness: dict[Side, Likeness] = {}
    judge = None
    if system.likeness and system.space == "character" and expressions and face.nose_tip in names:
        judge = ExpressionLikeness(face, expressions)
    for side, positions in by_side.items():
        measured = measure(
            positions, neutral, names, system.features, face.roles, face.nose_tip, unit
        )
        inputs[side] = smooth(measured, take.times, noise * system.smoothing)
        if judge is not None:
            moved = (positions - neutral).reshape(len(positions), -1)
            moved = smooth(moved, take.times, noise * system.smoothing)
            likeness[side] = judge.of(moved.reshape(positions.shape))
    markers = tuple(face.roles.get(f.role, f.role) for f in system.features)
    return Features(inputs, markers, unit, likeness)


def _check_roles(system: ExpressionSystem, names: Sequence[str], roles: Mapping[str, str]) -> None:
    """Raise InputError if the system reads a missing marker; name the first rule that does."""
    missing = {
        variable.name: feature.role
        for variable, feature in zip(system.fuzzy.inputs, system.features, strict=True)
        if roles.get(feature.role, feature.role) not in names
    }
    if not missing:
        return
    name, role = next(iter(missing.items()))
    rules = [r for r in system.fuzzy.rules if any(p.variable in missing for p in r.propositions)]
    others = len(rules) - 1
    by = f"{rules[0].named}{f' and {others} more' if others else ''}" if rules else "no rule"
    raise InputError(
        f"fuzzy variable {name!r} reads the role {role!r}, but there is no marker "
        f"{roles.get(role, role)!r}{did_you_mean(role, names)} (used "
        f'by {by}); name its marker in the binding, "roles": {{"{role}": ...}}',
        code="MARKER_UNKNOWN",
    )


def _take_markers(
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side],
) -> _SidedMarkers:
    """Return the take's own markers."""
    if solution is None or not isinstance(take, MarkerTake):
        raise InputError(
            "the fuzzy system reads the take's markers, but the take has weights only; "
            'set its space to "character"'
        )
    names, neutral = solution.markers, on_plane(solution.neutral)
    positions = solution.still(take)
    on_character = face.mesh.points[face.vertices_of(names)]
    return (
        names,
        neutral,
        _sided_positions(positions, neutral, on_character, names, face.nose_tip, sides),
    )


def _character_markers(
    face: BoundFace, weights: WeightsTake, solution: Solution | None, sides: Sequence[Side]
) -> _SidedMarkers:
    """Return the markers on the character at the solved weights, as far as the take moves them."""
    names, neutral = face.markers, face.neutral
    solved = weights.reordered(face.shape_names).weights
    pairs = symmetric_pairs(face.shape_names)
    whole = face.displacements(solved)
    if not len(pairs):
        positions = neutral + _shown(face, whole, whole, weights, solution, "both")
        by_side = _sided_positions(positions, neutral, neutral, names, face.nose_tip, sides)
        return names, neutral, by_side
    sided_weights = {s: solved if s == "both" else half_weights(solved, pairs, s) for s in sides}
    by_side = {
        side: neutral + _shown(face, face.displacements(w), whole, weights, solution, side)
        for side, w in sided_weights.items()
    }
    return names, neutral, by_side


def _sided_positions(
    positions: FloatArray,
    neutral: FloatArray,
    on_character: FloatArray,
    names: tuple[str, ...],
    nose_tip: str,
    sides: Sequence[Side],
) -> dict[Side, FloatArray]:
    """Return the positions of each side; without a nose tip, those of the whole face for all."""
    if nose_tip not in names:
        return dict.fromkeys(sides, positions)
    nose = names.index(nose_tip)
    return {
        s: positions if s == "both" else half_face(positions, neutral, on_character, nose, s)
        for s in sides
    }


def _shown(
    face: BoundFace,
    moved: FloatArray,
    solved: FloatArray,
    weights: WeightsTake,
    solution: Solution | None,
    side: Side,
) -> FloatArray:
    """Return displacements (F, M, 3) of a side, as large as the take's markers show the solved."""
    if solution is None or face.nose_tip not in solution.markers:
        return moved
    index = {name: i for i, name in enumerate(solution.markers)}
    seen = np.array([name in index for name in face.markers])
    at = [index[name] for name in np.array(face.markers)[seen]]
    nose = face.nose
    shown = solved.copy()
    shown[:, seen] = solution.feature_points[:, at] - solution.rest[at]
    sides = sides_of(face.neutral, midline(face.neutral, face.midline), 0.0)
    measured = seen if side == "both" else seen & (sides != (-1 if side == "left" else 1))
    upper = face.neutral[:, 1] > face.neutral[nose, 1]
    step = float(np.median(np.diff(weights.times))) if len(weights.times) > 1 else 1.0
    nose_at = [each[:, nose, None] for each in (solved, shown, moved)]
    gains = motion_gains(
        solved - nose_at[0], shown - nose_at[1], upper, measured, _GAIN_WIDTH / step
    )
    return np.asarray(nose_at[2] + gains[:, :, None] * (moved - nose_at[2]))
