"""Feature extraction: the inputs of a fuzzy system, of the whole face and of either half."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from usdface.arrays import FloatArray
from usdface.correction.expression_classifier import Classification, classifiers_of_sides
from usdface.correction.features import MILLIMETRE, face_unit, measure, smooth
from usdface.correction.sided_markers import Positions, character_markers, take_markers
from usdface.correction.take_classification import SidedMotion, classify_take, recorded_motion
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import SIDES, Side
from usdface.numerics.frame_blocks import by_blocks
from usdface.options import MARKER_NOISE
from usdface.retarget.solution import Solution
from usdface.setup.expression import Expression
from usdface.setup.pin import Pin
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Features", "features", "sided_features"]


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
        names, neutral, by_side = take_markers(face, take, solution, sides)
    else:
        names, neutral, by_side = character_markers(face, weights, solution, sides, pins)
    _check_roles(system, names, face.roles)
    unit = face_unit(system, neutral)
    # As in the solve: a take without noise is not smoothed.
    noise = min(solution.noise / (face.size * MARKER_NOISE), 1.0) if solution else 0.0
    width = noise * system.smoothing
    inputs: dict[Side, FloatArray] = {}
    for side, positions in by_side.items():

        def measured(frames: slice, positions: Positions = positions) -> FloatArray:
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
