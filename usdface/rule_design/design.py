"""The default fuzzy system, designed from a rig's own expression poses.

No recording is needed. For each expression `usdface.rule_design.feature_selection` picks a few
features that move well above the noise in its pose and, taken together, in none of the other poses
and in no movement of one or two blend shapes; where another expression shows them all, one more
condition says what it must not show besides. A feature's term is a ramp: 0 up to a dead zone around
neutral, 1 from its value at the pose on. Features are signed, so no rule fires on a neutral face,
and since blend shapes are linear, half a pose fires its rule by about a half.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding, finding
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import Axis, FuzzySystem, Term, Variable
from usdface.geometry.marker_spread import marker_spread
from usdface.retarget_setup import Expression
from usdface.rule_design.feature_selection import (
    Choice,
    choose_features,
    paired_movements,
    single_movements,
)
from usdface.rule_design.marker_roles import AXES, degrees, direction, marker_sides, role_names
from usdface.takes import FloatArray

__all__ = ["design_system", "face_features", "solved_noise"]

# Expected size of a weight, as the solve has it.
_SPREAD = 0.5


def design_system(
    face: BoundFace, expressions: Sequence[Expression], noise: float
) -> tuple[FuzzySystem, dict[str, str], list[Finding]]:
    """Design a fuzzy system that tells a face's expressions apart.

    Parameters
    ----------
    face : BoundFace
    expressions : sequence of Expression
    noise : float [m]
        Standard deviation of a marker's position along an axis, e.g. 0.0003.

    Returns
    -------
    system : FuzzySystem
        One output for each expression, and one rule for each that the markers show.
    roles : dict of str to str
        Role that the variables name, to marker.
    findings : list of Finding
        EXPRESSION_UNSEEN for each expression that no marker shows, or that the markers cannot
        tell from others; EXPRESSION_SHARED for each that another shows a little of.

    Raises
    ------
    InputError
        If there is no such nose tip, or the markers have no extent.
    """
    names, neutral, shape_names = face.markers, face.neutral, face.shape_names
    poses = np.array([e.pose(shape_names) for e in expressions])
    poses = poses.reshape(len(expressions), len(shape_names))
    features = face_features(face)
    single = single_movements(shape_names)
    paired = paired_movements(shape_names, single, features)
    jitter = solved_noise(face.evaluator.offsets, features.offsets, noise)
    upper = np.repeat(neutral[:, 1] > neutral[face.nose, 1], 3)
    choices = {
        expression.name: choose_features(i, poses, single, paired, features, jitter, upper)
        for i, expression in enumerate(expressions)
    }
    unit = marker_spread(neutral)
    roles = role_names(names)
    sides = marker_sides(neutral, face.nose)
    inputs = _inputs(choices.values(), roles, sides, unit)
    rules = [
        parse_rule(_text(emotion, choice, inputs, unit))
        for emotion, choice in choices.items()
        if choice.ramps
    ]
    outputs = [Variable(emotion, "output") for emotion in choices]
    system = FuzzySystem((*inputs.values(), *outputs), tuple(rules))
    used = {roles[i // 3]: names[i // 3] for i in inputs}
    return system, used, _findings(choices)


def face_features(face: BoundFace) -> BlendShapeEvaluator:
    """Return the evaluator of the features of a face, relative to its nose tip: N = 3 B."""
    nose = face.nose

    def relative(values: FloatArray) -> FloatArray:
        moved = values.reshape(*values.shape[:-1], len(face.markers), 3)
        return np.asarray((moved - moved[..., nose, None, :]).reshape(values.shape))

    return face.evaluator.mapped(relative)


def solved_noise(basis: FloatArray, features: FloatArray, noise: float) -> FloatArray:
    """Return what is left of the markers' noise in each feature after the solve: (I,) [m].

    The weights' covariance is that of ridge regression on the markers, for every frame alone.

    Parameters
    ----------
    basis, features : (S, I) float64 [m]
        Displacements as they are and relative to the nose tip.
    noise : float [m]
    """
    ridge = (noise / _SPREAD) ** 2 * np.eye(len(basis))
    inverse = np.linalg.pinv(basis @ basis.T + ridge, hermitian=True)
    variance = np.einsum("si,st,ti->i", features, inverse, features, optimize=True)
    return np.asarray(noise * np.sqrt(np.maximum(variance, 0.0)))


def _inputs(
    choices: Iterable[Choice], roles: Sequence[str], sides: Sequence[int], unit: float
) -> dict[int, Variable]:
    """Return an input variable for each feature that is used, with a term for each use."""
    ramps: dict[int, set[tuple[float, float]]] = defaultdict(set)
    for choice in choices:
        for feature, (foot, top) in (*choice.ramps.items(), *choice.excluded):
            ramps[feature].add((foot / unit, top / unit))
    inputs = {}
    for feature in sorted(ramps):
        role, axis = roles[feature // 3], AXES[feature % 3]
        terms = _terms(ramps[feature], axis, sides[feature // 3])
        inputs[feature] = Variable(f"{role}_{axis}", "input", role, axis, "signed", terms)
    return inputs


def _terms(ramps: set[tuple[float, float]], axis: Axis, side: int) -> tuple[Term, ...]:
    """Name the ramps of one variable after their direction and how far they reach."""
    terms = []
    for sign in (1, -1):
        reaching = sorted((r for r in ramps if r[1] * sign > 0), key=lambda ramp: abs(ramp[1]))
        word = direction(axis, sign, side)
        terms += [
            Term(f"{degree}{word}", "ramp", ramp)
            for degree, ramp in zip(degrees(len(reaching)), reaching, strict=True)
        ]
    return tuple(terms)


def _text(emotion: str, choice: Choice, inputs: dict[int, Variable], unit: float) -> str:
    conditions = []
    for word, ramps in (("IS", choice.ramps.items()), ("IS NOT", choice.excluded)):
        for feature, (foot, top) in ramps:
            ramp = (foot / unit, top / unit)
            term = next(t for t in inputs[feature].terms if t.parameters == ramp)
            conditions.append(f"{inputs[feature].name} {word} {term.name}")
    return f"IF {' AND '.join(conditions)} THEN {emotion} IS 1"


def _findings(choices: dict[str, Choice]) -> list[Finding]:
    names = list(choices)
    findings = []
    for emotion, choice in choices.items():
        if not choice.ramps:
            message = f"no marker shows {emotion} clearly above the noise; it gets no rule"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message))
        elif choice.confused:
            rivals = ", ".join(names[i] for i in choice.confused)
            message = f"the markers cannot tell {emotion} from {rivals}"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message))
        for other, degree in choice.shared:
            message = f"the markers show a little of {emotion} in {names[other]}, {degree:.2f}"
            findings.append(finding("EXPRESSION_SHARED", emotion, message))
    return findings
