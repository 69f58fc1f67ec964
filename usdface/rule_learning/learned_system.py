"""A fuzzy system learned from labelled examples: terms, rules and fallback rules.

The terms are those of `usdface.rule_learning.terms`, the rules those of
`usdface.rule_learning.rules`, the fallback rules those of `usdface.rule_learning.fallback_rules`.
A neutral face belongs to no term, so that only the else rule applies and all outputs are exactly 0.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.options import LEARNED_SMOOTHING, FeatureSpace
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.fallback_rules import learn_fallback_rules
from usdface.rule_learning.rules import LearnedRule, choose_groupings, learn_rules
from usdface.rule_learning.terms import LinguisticTerms, linguistic_terms
from usdface.rule_learning.variants import Grouping, variant_groupings

__all__ = ["LearnedSystem", "classify", "evaluate_examples", "evaluate_features", "fit_system"]

# Outputs below this are no emotion: benchmarks/expressions.py asks for the right emotion to be the
# strongest from an intensity of 15 % on, and an output is about the intensity.
_LEAST_OUTPUT = 0.15


@dataclass(frozen=True, slots=True)
class LearnedSystem:
    """A learned system.

    Attributes
    ----------
    system : ExpressionSystem
        One output for each emotion of the examples.
    fallback_rules : tuple of Rule
        Its last rules, which decide only where no other rule fires.
    without_rule : tuple of str
        Emotions without a rule: no conjunction of few terms distinguishes them.
    """

    system: ExpressionSystem
    fallback_rules: tuple[Rule, ...]
    without_rule: tuple[str, ...]

    @property
    def findings(self) -> list[Finding]:
        """EXPRESSION_UNSEEN for each emotion without a rule."""
        return [
            finding(
                "EXPRESSION_UNSEEN",
                name,
                "no rule of up to three conditions distinguishes {expression}; it gets none",
                name,
            )
            for name in self.without_rule
        ]


def fit_system(examples: Examples, space: FeatureSpace = "character") -> LearnedSystem:
    """Learn terms and rules from examples.

    Parameters
    ----------
    examples : Examples
    space : {"character", "take"}
        Where their features were measured.
    """
    groupings = variant_groupings(examples)
    candidates = linguistic_terms(examples, _groups(*groupings.values()))
    chosen = choose_groupings(examples, candidates, groupings)
    terms = linguistic_terms(examples, _groups(chosen.values()))
    learned = learn_rules(examples, terms, chosen)
    learned += learn_fallback_rules(examples, terms, learned)
    rules = tuple(_rule(rule, terms, examples) for rule in learned)
    outputs = tuple(Variable(emotion, "output") for emotion in examples.names)
    used = _used_terms(learned, terms)
    features = tuple(examples.marker_features[i] for i in used)
    inputs = tuple(
        Variable(feature.name, "input", own)
        for feature, own in zip(features, used.values(), strict=True)
    )
    fuzzy = FuzzySystem((*inputs, *outputs), rules, normalisation="all_rules", else_rule=True)
    known = {rule.emotion for rule in learned}
    return LearnedSystem(
        ExpressionSystem(fuzzy, features, space=space, smoothing=LEARNED_SMOOTHING),
        tuple(rule for rule, made in zip(rules, learned, strict=True) if made.fallback),
        tuple(name for name in examples.names if name not in known),
    )


def _groups(*groupings: Iterable[Grouping]) -> list[BoolArray]:
    return [group for several in groupings for grouping in several for group in grouping]


def evaluate_examples(system: ExpressionSystem, examples: Examples) -> FloatArray:
    """Evaluate a fitted system on examples: (N, E)."""
    return evaluate_features(system, examples.marker_features, examples.features)


def evaluate_features(
    system: ExpressionSystem, columns: tuple[MarkerFeature, ...], features: FloatArray
) -> FloatArray:
    """Evaluate a fitted system on features (N, I) of which it reads some columns: (N, E)."""
    read = [columns.index(feature) for feature in system.features]
    return evaluate(system.fuzzy, features[:, read]).outputs


def classify(outputs: FloatArray, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the strongest emotion of each row of `outputs` (N, E), or `NO_EMOTION`."""
    if not names:
        return (NO_EMOTION,) * len(outputs)
    strongest = np.argmax(outputs, axis=1)
    recognised = outputs[np.arange(len(outputs)), strongest] >= _LEAST_OUTPUT
    return tuple(
        names[i] if known else NO_EMOTION for i, known in zip(strongest, recognised, strict=True)
    )


def _rule(learned: LearnedRule, terms: LinguisticTerms, examples: Examples) -> Rule:
    features = examples.marker_features
    conditions = [
        f"{features[terms.feature[term]].name} IS {'NOT ' * negated}{terms.names[term]}"
        for term, negated in learned.conditions
    ]
    return parse_rule(f"IF {' AND '.join(conditions)} THEN {learned.emotion} IS 1", learned.weight)


def _used_terms(learned: list[LearnedRule], terms: LinguisticTerms) -> dict[int, tuple[Term, ...]]:
    """Return the features in the rules, each with all its terms of the same direction."""
    directions = {
        (int(terms.feature[term]), int(np.sign(terms.top[term])))
        for rule in learned
        for term, _ in rule.conditions
    }
    return {
        feature: tuple(
            term
            for sign in (1, -1)
            if (feature, sign) in directions
            for term in terms.terms_of(feature, sign)
        )
        for feature in sorted({feature for feature, _ in directions})
    }
