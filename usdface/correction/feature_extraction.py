"""What a fuzzy system reads off a face: its features, of the whole and of either half."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from usdface.arrays import FloatArray
from usdface.correction.features import MILLIMETRE, face_unit, measure, smooth
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import SIDES, Side, half_face, half_weights
from usdface.face.symmetry import symmetric_pairs
from usdface.options import MARKER_NOISE
from usdface.retarget.neutral import on_plane
from usdface.retarget.solution import Solution
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Features", "features", "sided_features"]


@dataclass(frozen=True, eq=False, slots=True)
class Features:
    """The inputs of a fuzzy system, read off a face.

    Attributes
    ----------
    sides : mapping of "both", "left", "right" to (F, I) float64
        Of the face as it is, and as each half would have it if the other did the same.
    markers : tuple of str, length I
        The marker that each input reads.
    unit : float [m]
        The length that inputs are divided by.
    """

    sides: Mapping[Side, FloatArray]
    markers: tuple[str, ...] = ()
    unit: float = MILLIMETRE


# Names of markers, where they rest (M, 3), and where they are by the word of each side (F, M, 3).
_Faces = tuple[tuple[str, ...], FloatArray, dict[Side, FloatArray]]


def features(
    system: ExpressionSystem,
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    *,
    weights: WeightsTake,
    solution: Solution | None,
) -> FloatArray:
    """Measure the inputs in the space the system asks for, smoothed as noise demands: (F, I).

    Weights of shapes that other meshes of the rig have, and orders other than the mesh's, change
    nothing.

    Raises
    ------
    InputError
        If the space is the take's and the take has no markers, or the system reads a marker
        that is not there.
    """
    read = sided_features(system, face, take, weights=weights, solution=solution, sides=("both",))
    return read.sides["both"]


def sided_features(
    system: ExpressionSystem,
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    *,
    weights: WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side] = SIDES,
) -> Features:
    """Measure the inputs of each side as they would be if the other did the same.

    Of "both" as they are; errors as those of `features`.
    """
    if system.space == "take":
        names, neutral, faces = _recorded(face, take, solution, sides)
    else:
        names, neutral, faces = _drawn(face, weights, sides)
    _check_roles(system, names, face.roles)
    unit = face_unit(system, neutral)
    # As in the solve: what was recorded without noise is read frame by frame.
    noise = min(solution.noise / MARKER_NOISE, 1.0) if solution else 0.0
    read: dict[Side, FloatArray] = {}
    for side, positions in faces.items():
        measured = measure(
            positions, neutral, names, system.features, face.roles, face.nose_tip, unit
        )
        read[side] = smooth(measured, take.times, noise * system.smoothing)
    markers = tuple(face.roles.get(f.role, f.role) for f in system.features)
    return Features(read, markers, unit)


def _check_roles(system: ExpressionSystem, names: Sequence[str], roles: Mapping[str, str]) -> None:
    """Refuse a system that reads a marker which is not there; name the first of its rules."""
    lacking = {
        variable.name: feature.role
        for variable, feature in zip(system.fuzzy.inputs, system.features, strict=True)
        if roles.get(feature.role, feature.role) not in names
    }
    if not lacking:
        return
    name, role = next(iter(lacking.items()))
    rules = [r for r in system.fuzzy.rules if any(p.variable in lacking for p in r.propositions)]
    others = len(rules) - 1
    by = f"{rules[0].named}{f' and {others} more' if others else ''}" if rules else "no rule"
    raise InputError(
        f"fuzzy variable {name!r} reads the role {role!r}, but there is no marker "
        f"{roles.get(role, role)!r}{did_you_mean(role, names)} (asked for "
        f'by {by}); name its marker in the binding, "roles": {{"{role}": ...}}',
        code="MARKER_UNKNOWN",
    )


def _recorded(
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side],
) -> _Faces:
    """Return the take's own markers."""
    if solution is None or not isinstance(take, MarkerTake):
        raise InputError(
            "the fuzzy system reads the take's markers, but the take has weights only; "
            'set its space to "character"'
        )
    names, neutral = solution.markers, on_plane(solution.neutral)
    positions = solution.pose.to_head(on_plane(take.select(names)))
    at_rest = face.mesh.points[face.vertices_of(names)]
    return names, neutral, _halves(positions, neutral, at_rest, names, face.nose_tip, sides)


def _drawn(face: BoundFace, weights: WeightsTake, sides: Sequence[Side]) -> _Faces:
    """Return the markers as they are on the character."""
    names, neutral = face.markers, face.neutral
    solved = weights.reordered(face.shape_names).weights
    pairs = symmetric_pairs(face.shape_names)
    if not len(pairs):
        positions = neutral + face.displacements(solved)
        faces = _halves(positions, neutral, neutral, names, face.nose_tip, sides)
        return names, neutral, faces
    shown = {s: solved if s == "both" else half_weights(solved, pairs, s) for s in sides}
    return names, neutral, {side: neutral + face.displacements(w) for side, w in shown.items()}


def _halves(
    positions: FloatArray,
    neutral: FloatArray,
    at_rest: FloatArray,
    names: tuple[str, ...],
    nose_tip: str,
    sides: Sequence[Side],
) -> dict[Side, FloatArray]:
    """Return the face as it is and those that its halves make; without a nose all are the same."""
    if nose_tip not in names:
        return dict.fromkeys(sides, positions)
    nose = names.index(nose_tip)
    return {
        s: positions if s == "both" else half_face(positions, neutral, at_rest, nose, s)
        for s in sides
    }
