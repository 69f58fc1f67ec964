"""The outputs of a fuzzy system, combined with the classification of the whole face."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.expression_classifier import Classification
from usdface.expression_system import ExpressionSystem
from usdface.face.mirror import Side
from usdface.fuzzy.inference import Evaluation
from usdface.setup.expression import Expression

__all__ = ["combined_outputs", "with_classification"]

# Tuned with the classifier; see docs/constants.md.
# Largest output of the classifier alone.
_MOST = 0.5
# A performer whose strongest expression is less than this is scaled up to it, by so much at most.
_USUAL_STRENGTH, _LARGEST_GAIN = 0.45, 2.0


def with_classification(
    system: ExpressionSystem,
    classifications: Mapping[Side, Classification],
    by_rules: Mapping[Side, Evaluation],
    expressions: Sequence[Expression],
) -> dict[Side, Evaluation]:
    """Return the evaluations with the classification of the whole face in their outputs.

    A `system.likeness` up to 0.5 suppresses rules that the classification contradicts. Above, a
    classified emotion is an output of its own, by the largest weight of its enabled rules.
    """
    if not classifications:
        return dict(by_rules)
    names = [expression.name for expression in expressions]
    columns = [names.index(name) if name in names else None for name in system.emotions]
    weights = np.array(
        [
            max(2.0 * system.likeness - 1.0, 0.0) * _rule_weight(system, name)
            if column is not None
            else 0.0
            for name, column in zip(system.emotions, columns, strict=True)
        ]
    )
    at = [column or 0 for column in columns]
    posed = np.array([column is not None for column in columns])
    suppression = min(2.0 * system.likeness, 1.0)
    by_emotion = {
        side: Classification(
            found.confidence[:, at], found.amplitude[:, at], found.contradiction[:, at] * posed
        )
        for side, found in classifications.items()
    }
    whole = by_emotion["both"]
    rule_outputs = by_rules["both"].outputs * (1.0 - suppression * whole.contradiction)
    strength = np.maximum(whole.detected, rule_outputs).max(axis=0, initial=0.0)
    found = {}
    for side, evaluation in by_rules.items():
        outputs = combined_outputs(
            evaluation.outputs, by_emotion[side], weights, strength, suppression
        )
        found[side] = replace(evaluation, outputs=outputs)
    return found


def _rule_weight(system: ExpressionSystem, emotion: str) -> float:
    """Return the largest weight of an emotion's enabled rules."""
    return max(
        (
            rule.weight
            for rule in system.fuzzy.rules
            if rule.enabled and any(name == emotion for name, _ in rule.consequents)
        ),
        default=0.0,
    )


def combined_outputs(
    outputs: FloatArray,
    classification: Classification,
    weights: FloatArray,
    strength: FloatArray,
    suppression: float = 1.0,
) -> FloatArray:
    """Return the outputs (F, E) of rules, combined with the classification of the face.

    Parameters
    ----------
    outputs : (F, E) float64
    classification : Classification
    weights : (E,) float64
        How far the classification counts for each emotion, 0 to 1.
    strength : (E,) float64
        The largest output or `Classification.detected` of each emotion over the take. Amplitudes
        of a performer who moves by less than about half of the character's pose are scaled up.
    suppression : float
        How far a contradiction suppresses a rule, 0 to 1.
    """
    gain = np.clip(_USUAL_STRENGTH / np.maximum(strength, 1e-12), 1.0, _LARGEST_GAIN)
    amplitude = np.minimum(gain * classification.amplitude, 1.0)
    detected = np.minimum(classification.confidence * amplitude, _MOST)
    remaining = outputs * (1.0 - suppression * classification.contradiction)
    return np.maximum(remaining, weights * detected)
