"""The default fuzzy system, designed from a rig's own expression poses.

No recording is needed. For each expression `usdface.rule_design.feature_selection` picks features
of both sides that move strongly in its pose and, most of them together, in none of the other poses
and in no other movement; where another expression has them, a negated condition excludes
it. A feature's term is a ramp: 0 up to a dead zone around neutral, 1 from its value at the pose
on. Features are signed, so no rule fires on a neutral face, and since blend shapes are linear,
half a pose fires its rule by a half.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.expression_system import Axis, ExpressionSystem, MarkerFeature
from usdface.face.bound_face import BoundFace
from usdface.face.full_face_expressions import moves_brows_and_mouth
from usdface.face.mirror import midline, mirrored_markers
from usdface.findings import Finding, finding
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.geometry.marker_spread import marker_spread
from usdface.options import MARKER_NOISE
from usdface.rule_design.face_motions import FaceMotions
from usdface.rule_design.feature_errors import feature_errors, misplacement
from usdface.rule_design.feature_noise import solved_noise
from usdface.rule_design.feature_selection import SelectedFeatures, select_features
from usdface.rule_design.marker_roles import (
    AXES,
    degree_prefixes,
    direction_name,
    marker_sides,
    role_names,
)
from usdface.rule_design.movements import movements
from usdface.rule_design.negative_conditions import Ramp
from usdface.rule_design.selection_cost import FEWEST
from usdface.setup.expression import Expression

__all__ = ["design_system", "face_features"]


def design_system(
    face: BoundFace, expressions: Sequence[Expression]
) -> tuple[ExpressionSystem, dict[str, str], list[Finding]]:
    """Design an expression system that distinguishes the expressions of a face.

    Parameters
    ----------
    face : BoundFace
    expressions : sequence of Expression

    Returns
    -------
    system : ExpressionSystem
        One output for each expression, and a rule for each that the markers show.
    roles : dict of str to str
        Roles of the features to markers.
    findings : list of Finding
        EXPRESSION_UNSEEN for each expression that no marker shows, or that the markers cannot
        distinguish from others; EXPRESSION_SHARED for each whose rule fires weakly in another.

    Raises
    ------
    InputError
        If the face has no nose tip, or the markers have no extent.
    """
    face = face.at_human_size().with_sorted_shapes()
    names, neutral, shape_names = face.markers, face.neutral, face.shape_names
    poses = np.array([e.pose(shape_names) for e in expressions])
    poses = poses.reshape(len(expressions), len(shape_names))
    features, upper = face_features(face), neutral[:, 1] > neutral[face.nose, 1]
    motions = FaceMotions(
        features, np.repeat(upper, 3), _twins(face), poses, movements(shape_names)
    )
    jitter = solved_noise(face.evaluator.offsets, features.offsets, MARKER_NOISE)
    misplaced, shown = misplacement(face, poses), motions.features(poses)
    selections = {
        expression.name: select_features(
            i,
            motions,
            feature_errors(shown[i], jitter, misplaced[i]),
            apart=moves_brows_and_mouth(face, expression),
        )
        for i, expression in enumerate(expressions)
    }
    unit = marker_spread(neutral)
    roles = role_names(names)
    sides = marker_sides(neutral, face.nose)
    read = _marker_features(selections.values(), roles)
    inputs = _inputs(selections.values(), read, sides, unit)
    outputs = [Variable(emotion, "output") for emotion in selections]  # refuses unusable names
    rules = [
        parse_rule(_rule_text(emotion, selection, inputs, unit))
        for emotion, selection in selections.items()
        if selection.ramps
    ]
    fuzzy = FuzzySystem(
        (*inputs.values(), *outputs), tuple(rules), normalisation="all_rules", else_rule=True
    )
    system = ExpressionSystem(fuzzy, tuple(read.values()))
    roles_used = {roles[i // 3]: names[i // 3] for i in inputs}
    return system, roles_used, _findings(selections)


def face_features(face: BoundFace) -> BlendShapeEvaluator:
    """Return the evaluator of the features of a face, relative to its nose tip: N = 3 B."""
    nose = face.nose

    def relative(values: FloatArray) -> FloatArray:
        moved = values.reshape(*values.shape[:-1], len(face.markers), 3)
        return np.asarray((moved - moved[..., nose, None, :]).reshape(values.shape))

    return face.evaluator.mapped(relative)


def _twins(face: BoundFace) -> IntArray:
    """Return the feature of each marker's mirror image (I,); itself where there is none."""
    own = np.arange(len(face.markers))
    partner = mirrored_markers(face.neutral, midline(face.neutral, face.midline))
    return np.asarray((3 * np.where(partner < 0, own, partner)[:, None] + np.arange(3)).ravel())


def _marker_features(
    selections: Iterable[SelectedFeatures], roles: Sequence[str]
) -> dict[int, MarkerFeature]:
    """Return the features of all conditions."""
    used = {i for selection in selections for i, _ in selection.terms}
    return {i: MarkerFeature(roles[i // 3], AXES[i % 3]) for i in sorted(used)}


def _inputs(
    selections: Iterable[SelectedFeatures],
    features: dict[int, MarkerFeature],
    sides: Sequence[int],
    unit: float,
) -> dict[int, Variable]:
    """Return an input variable for each feature, with a term for each use."""
    ramps: dict[int, set[tuple[float, float]]] = defaultdict(set)
    for selection in selections:
        for feature, (foot, top) in selection.terms:
            ramps[feature].add((foot / unit, top / unit))
    inputs = {}
    for i, read in features.items():
        terms = _terms(ramps[i], read.axis, sides[i // 3])
        inputs[i] = Variable(read.name, "input", terms)
    return inputs


def _terms(ramps: set[tuple[float, float]], axis: Axis, side: int) -> tuple[Term, ...]:
    """Name the ramps of one variable after their direction and their distance from neutral."""
    terms = []
    for sign in (1, -1):
        reaching = sorted((r for r in ramps if r[1] * sign > 0), key=lambda ramp: abs(ramp[1]))
        word = direction_name(axis, sign, side)
        terms += [
            Term(f"{degree}{word}", "ramp", ramp)
            for degree, ramp in zip(degree_prefixes(len(reaching)), reaching, strict=True)
        ]
    return tuple(terms)


def _rule_text(
    emotion: str, selection: SelectedFeatures, inputs: dict[int, Variable], unit: float
) -> str:
    def condition(feature: int, ramp: Ramp) -> str:
        scaled = tuple(value / unit for value in ramp)
        term = next(t for t in inputs[feature].terms if t.parameters == scaled)
        return f"{inputs[feature].name} IS {term.name}"

    joined = []
    for group in selection.groups:
        held = [condition(f, selection.ramps[f]) for f in group]
        joined += [f"MOST OF ({', '.join(held)})"] if len(held) >= FEWEST else held
    for negative in selection.negative:
        both = " AND ".join(condition(feature, ramp) for feature, ramp in negative)
        joined.append(f"NOT ({both})" if len(negative) > 1 else both.replace(" IS ", " IS NOT "))
    return f"IF {' AND '.join(joined)} THEN {emotion} IS 1"


def _findings(selections: dict[str, SelectedFeatures]) -> list[Finding]:
    names = list(selections)
    findings = []
    for emotion, selection in selections.items():
        if not selection.ramps:
            message = "no marker shows {expression} clearly above the noise; it gets no rule"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message, emotion))
        elif selection.confused:
            rivals = [names[i] for i in selection.confused]
            message = "the markers cannot distinguish {expression} from {others}"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message, emotion, rivals))
        for other, degree in selection.shared:
            message = "the markers show a little of {expression} in {other}, {degree:.2f}"
            values = emotion, names[other], degree
            findings.append(finding("EXPRESSION_SHARED", emotion, message, *values))
    return findings
