"""Feature extraction: the inputs of a fuzzy system, of the whole face and of either half."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.correction.expression_classifier import Classification, classifiers_of_sides
from usdface.correction.features import MILLIMETRE, face_unit, measure, smooth
from usdface.correction.motion_gain import LEAST_MOTION, motion_gains, motion_products
from usdface.correction.take_classification import SidedMotion, classify_take, recorded_motion
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import SIDES, Side, half_face, half_weights, midline, sides_of
from usdface.face.symmetry import symmetric_pairs
from usdface.numerics.frame_blocks import by_blocks
from usdface.options import MARKER_NOISE
from usdface.retarget.neutral import on_plane
from usdface.retarget.pins import pin_nearness
from usdface.retarget.recorded_gaze import gaze_shapes
from usdface.retarget.solution import Solution
from usdface.setup.expression import Expression
from usdface.setup.pin import Pin
from usdface.takes import MarkerTake, WeightsTake, frame_step

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
    classifications : mapping of "both", "left", "right" to Classification
        How far the motion of each side is that of the expressions; empty where only rules count.
    """

    sides: Mapping[Side, FloatArray]
    markers: tuple[str, ...] = ()
    unit: float = MILLIMETRE
    classifications: Mapping[Side, Classification] = field(default_factory=dict)


# Positions (B, M, 3) of markers in some frames.
_Positions = Callable[[slice], FloatArray]
# Names of markers, their neutral positions (M, 3), and their positions for each side.
_SidedMarkers = tuple[tuple[str, ...], FloatArray, dict[Side, _Positions]]


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
    pins: Sequence[Pin] = (),
) -> Features:
    """Measure the inputs of the whole face and of each half, mirrored to the other side.

    With `expressions` the motion is also classified, if the system uses it. Frames that
    `pins` bend do not measure how far the performer moves. Raises as `features`.
    """
    if system.space == "take":
        names, neutral, by_side = _take_markers(face, take, solution, sides)
    else:
        names, neutral, by_side = _character_markers(face, weights, solution, sides, pins)
    _check_roles(system, names, face.roles)
    unit = face_unit(system, neutral)
    # As in the solve: a take without noise is not smoothed.
    noise = min(solution.noise / (face.size * MARKER_NOISE), 1.0) if solution else 0.0
    width = noise * system.smoothing
    inputs: dict[Side, FloatArray] = {}
    for side, positions in by_side.items():

        def measured(frames: slice, positions: _Positions = positions) -> FloatArray:
            return measure(
                *(positions(frames), neutral, names, system.features),
                *(face.roles, face.nose_tip, unit),
            )

        inputs[side] = smooth(by_blocks(len(take.times), measured), take.times, width)
    classifications: Mapping[Side, Classification] = {}
    if system.likeness and expressions and _whole_face(system, face, names):

        def moved(frames: slice) -> Mapping[Side, FloatArray]:
            return {side: positions(frames) - neutral for side, positions in by_side.items()}

        motion: SidedMotion = moved
        if solution:
            motion = recorded_motion(face, solution, sides, times=take.times, width=width)
        classifiers = classifiers_of_sides(face, expressions, sides)
        classifications = classify_take(classifiers, motion, len(take.times))
    markers = tuple(face.roles.get(f.role, f.role) for f in system.features)
    return Features(inputs, markers, unit, classifications)


def _whole_face(system: ExpressionSystem, face: BoundFace, names: Sequence[str]) -> bool:
    """Whether markers of the character are read, with a nose tip that all others move against."""
    return system.space == "character" and face.nose_tip in names


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
        f"fuzzy variable {name!r} (used by {by}) reads the role {role!r}, but there is no marker "
        f'{roles.get(role, role)!r}; name it in the binding, "roles": {{"{role}": ...}}'
        f"{did_you_mean(role, names)}",
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
    still = solution.still(take)
    on_character = face.mesh.points[face.vertices_of(names)]

    def positions(frames: slice) -> FloatArray:
        return still[frames]

    at_rest = neutral, on_character
    return names, neutral, _sided_positions(positions, *at_rest, names, face.nose_tip, sides)


def _character_markers(
    face: BoundFace,
    weights: WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side],
    pins: Sequence[Pin],
) -> _SidedMarkers:
    """Return the markers on the solved character, their motion scaled to that of the take."""
    names, neutral = face.markers, face.neutral
    solved = weights.reordered(face.shape_names)
    pairs = symmetric_pairs(face.shape_names)
    bent = _bent_by_pins(face, solved, pins)
    if len(pairs):
        return (
            names,
            neutral,
            {s: _scaled_positions(face, solved, solution, s, bent) for s in sides},
        )
    positions = _scaled_positions(face, solved, solution, "both", bent)
    by_side = _sided_positions(positions, neutral, neutral, names, face.nose_tip, sides)
    return names, neutral, by_side


def _sided_positions(
    positions: _Positions,
    neutral: FloatArray,
    on_character: FloatArray,
    names: tuple[str, ...],
    nose_tip: str,
    sides: Sequence[Side],
) -> dict[Side, _Positions]:
    """Return the positions of each side; without a nose tip, those of the whole face for all."""
    if nose_tip not in names:
        return dict.fromkeys(sides, positions)
    nose = names.index(nose_tip)

    def of(side: Side) -> _Positions:
        return lambda frames: half_face(positions(frames), neutral, on_character, nose, side)

    return {side: positions if side == "both" else of(side) for side in sides}


def _scaled_positions(
    face: BoundFace, solved: WeightsTake, solution: Solution | None, side: Side, bent: BoolArray
) -> _Positions:
    """Return a side's markers on the solved character, their motion scaled to that of the take.

    The lower and the upper half in frames that are `bent` (F, 2) are not compared with the take.
    """
    pairs = symmetric_pairs(face.shape_names)

    def moved(frames: slice) -> FloatArray:
        own = solved.weights[frames]
        return face.displacements(own if side == "both" else half_weights(own, pairs, side))

    if solution is None or face.nose_tip not in solution.markers:
        return lambda frames: face.neutral + moved(frames)
    upper = _upper(face)
    gains, half = _gains(face, solved, solution, side, bent), upper.astype(np.intp)

    def scaled(frames: slice) -> FloatArray:
        at = moved(frames)
        nose = at[:, face.nose, None]
        return np.asarray(face.neutral + (nose + gains[frames][:, half, None] * (at - nose)))

    return scaled


def _gains(
    face: BoundFace, solved: WeightsTake, solution: Solution, side: Side, bent: BoolArray
) -> FloatArray:
    """Return by how much the lower and the upper half move further than solved: (F, 2)."""
    index = {name: i for i, name in enumerate(solution.markers)}
    used = np.array([name in index for name in face.markers])
    at = [index[name] for name in np.array(face.markers)[used]]
    sides = sides_of(face.neutral, midline(face.neutral, face.midline), 0.0)
    measured = used if side == "both" else used & (sides != (-1 if side == "left" else 1))

    def products(frames: slice) -> FloatArray:
        own = face.displacements(solved.weights[frames])
        recorded = own.copy()
        recorded[:, used] = solution.feature_points[frames][:, at] - solution.rest[at]
        own, recorded = (each - each[:, face.nose, None] for each in (own, recorded))
        return motion_products(own, recorded, _upper(face), measured)

    times = solved.times
    step = frame_step(times) if len(times) > 1 else 1.0
    unbent = by_blocks(len(times), products) * ~bent[..., None]
    return motion_gains(unbent, _GAIN_WIDTH / step, face.size)


def _upper(face: BoundFace) -> BoolArray:
    """Return the markers above the nose tip: (M,)."""
    return np.asarray(face.neutral[:, 1] > face.neutral[face.nose, 1])


def _bent_by_pins(face: BoundFace, solved: WeightsTake, pins: Sequence[Pin]) -> BoolArray:
    """Return in which frames pins bend the motion of the lower and the upper half: (F, 2).

    A half is bent by blend shapes that move its markers by more than the least motion that counts;
    not by those of gaze, which a recorder may have pinned in all frames.
    """
    bent = np.zeros((len(solved.times), 2), dtype=bool)
    gaze = gaze_shapes(solved.names) if pins else ()
    pins = [pin for pin in pins if pin.shape not in gaze]
    if not pins or face.nose_tip not in face.markers:
        return bent
    near = pin_nearness(pins, solved.names, solved.times) > 0.0
    pinned = near.any(axis=0)
    moved = face.displacements(np.eye(len(solved.names))[pinned])
    squares = ((moved - moved[:, face.nose, None]) ** 2).sum(axis=2)
    for half, own in enumerate((~_upper(face), _upper(face))):
        if own.any():
            moving = squares[:, own].mean(axis=1) > (face.size * LEAST_MOTION) ** 2
            bent[:, half] = near[:, pinned][:, moving].any(axis=1)
    return bent
