"""Fitting a fuzzy system: from the rig's own poses, or from labelled takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.default_system import design
from usdface.correction.rule_check import check_rules
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.fuzzy.rules import Rule
from usdface.options import CorrectionOptions, FitOptions
from usdface.rule_design.marker_roles import known_roles, marker_features
from usdface.rule_design.paper_design import fit_paper
from usdface.rule_learning.cross_validation import Validation, cross_validate, held_out
from usdface.rule_learning.expression_poses import learned_poses
from usdface.rule_learning.labelled_takes import Labelled, feature_noise, pose_features
from usdface.rule_learning.learned_system import evaluate_features, fit_system
from usdface.rule_learning.separation import Separation, pose_separations, separations
from usdface.setup.expression import Expression

__all__ = ["Fitted", "fit_labelled", "fit_rig"]


@dataclass(frozen=True, eq=False, slots=True)
class Fitted:
    """A fitted system, its expression poses and its tests.

    Attributes
    ----------
    system : ExpressionSystem
    fallback_rules : tuple of Rule
        Its rules for faces on which no other rule fires, see `LearnedSystem`.
    expressions : tuple of Expression
        A pose for each emotion.
    validation : Validation or None
        None where there are no examples.
    separations : tuple of Separation
        Of every two emotions.
    neutral : float
        The largest output for a neutral face.
    findings : tuple of Finding
    """

    system: ExpressionSystem
    fallback_rules: tuple[Rule, ...]
    expressions: tuple[Expression, ...]
    validation: Validation | None
    separations: tuple[Separation, ...]
    neutral: float
    findings: tuple[Finding, ...]

    @property
    def summary(self) -> dict[str, Any]:
        """A few numbers, under stable keys."""
        facts: dict[str, Any] = {
            "emotions": list(self.system.emotions),
            "rules": len(self.system.fuzzy.rules) - len(self.fallback_rules),
            "fallback_rules": len(self.fallback_rules),
            "inputs": len(self.system.features),
            "neutral_output_max": round(self.neutral, 4),
        }
        tested = self.validation
        if tested is not None and tested.tested:
            facts["cross_validation"] = {
                "held_out": tested.holding,
                "correct": tested.right,
                "tested": tested.tested,
            }
        return facts

    @property
    def details(self) -> dict[str, Any]:
        """All of it as plain values, for a report."""
        facts: dict[str, Any] = {
            "rules": [rule.text for rule in self.system.fuzzy.rules],
            "weights": [rule.weight for rule in self.system.fuzzy.rules],
            "separations": [pair.as_dict() for pair in self.separations],
        }
        if self.validation is not None:
            facts["validation"] = self.validation.as_dict()
        return {"fit": facts}


def fit_rig(face: BoundFace, expressions: Sequence[Expression], options: FitOptions) -> Fitted:
    """Fit to the rig's own expression poses: the default design, or the paper's.

    Raises
    ------
    InputError
        If the rig has no expression poses or no bound markers, or the features are those of a
        take, which needs labels.
    """
    if options.space == "take" and not options.paper:
        raise InputError('the default design reads the character; give labels for space "take"')
    roles = known_roles(face.markers, face.roles)
    columns = marker_features(roles, "absolute" if options.paper else "signed")
    poses = np.array([e.pose(face.shape_names) for e in expressions])
    measured = pose_features(poses.reshape(len(expressions), -1), face, columns)
    noise = feature_noise(face, "take" if options.paper else "character")
    emotions = [e.name for e in expressions]
    if options.paper:
        system, findings = fit_paper(columns, measured, emotions, noise, options.space)
    else:
        system, findings = _designed(face, expressions)
    pairs = tuple(pose_separations(emotions, measured, noise, columns))
    findings = [*findings, *(f for pair in pairs for f in pair.findings())]
    return _fit_result(system, tuple(expressions), None, pairs, findings)


def _designed(
    face: BoundFace, expressions: Sequence[Expression]
) -> tuple[ExpressionSystem, list[Finding]]:
    system, _, findings = design(face, expressions, CorrectionOptions())
    if system is None:
        raise InputError("the rig has no expression poses to fit to; give labelled takes")
    return system, findings


def fit_labelled(labelled: Labelled, face: BoundFace, options: FitOptions) -> Fitted:
    """Fit to labelled examples, with a cross-validation.

    Raises
    ------
    InputError
        If the examples do not determine a system.
    """
    examples = labelled.examples
    poses = learned_poses(examples, labelled.weights, labelled.shape_names)
    if options.paper:
        references, emotions = _references(labelled)
        noise = feature_noise(face, "take")
        system, findings = fit_paper(
            examples.marker_features, references, emotions, noise, options.space
        )
        return _fit_result(system, poses, None, (), findings)
    learned = fit_system(examples, options.space)
    system = learned.system
    holding = held_out(examples) if options.hold_out == "auto" else options.hold_out
    validation = cross_validate(examples, holding)
    pairs = tuple(separations(examples, holding))
    findings = [
        *learned.findings,
        *validation.findings(),
        *(f for pair in pairs for f in pair.findings()),
    ]
    return _fit_result(system, poses, validation, pairs, findings, learned.fallback_rules)


def _references(labelled: Labelled) -> tuple[FloatArray, list[str]]:
    """Return the mean features of each emotion's variants: (R, I), and the emotion of each."""
    examples = labelled.examples
    groups = [(e, v) for e in examples.names for v in sorted(examples.variants_of(e))]
    means = [np.nan_to_num(examples.whole[examples.rows(*g)]).mean(axis=0) for g in groups]
    return np.array(means), [emotion for emotion, _ in groups]


def _fit_result(
    system: ExpressionSystem,
    expressions: tuple[Expression, ...],
    validation: Validation | None,
    pairs: tuple[Separation, ...],
    findings: Sequence[Finding],
    fallback_rules: tuple[Rule, ...] = (),
) -> Fitted:
    neutral_outputs = evaluate_features(
        system, system.features, np.zeros((1, len(system.features)))
    )
    found = (*findings, *check_rules(system))
    return Fitted(
        system,
        fallback_rules,
        expressions,
        validation,
        pairs,
        float(neutral_outputs.max(initial=0.0)),
        found,
    )
