"""A fuzzy system learned from labelled examples: few rules, in words that people use.

The terms are those of `usdface.rule_learning.terms`, the rules those of
`usdface.rule_learning.rules`.
A neutral face meets none of the terms and a silent rule stands for it, so it answers exactly 0.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from usdface.findings import Finding, finding
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rules import Rule, parse_rule
from usdface.fuzzy.system import FuzzySystem, Space, Variable
from usdface.options import LEARNED_SMOOTHING
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.fallback_rules import learn_hints
from usdface.rule_learning.rules import LearnedRule, cheapest_partings, learn_rules
from usdface.rule_learning.terms import Words, words_of
from usdface.rule_learning.variants import Parting, partings
from usdface.takes import BoolArray, FloatArray

__all__ = ["answers", "answers_to", "fit_system", "heard"]

# Outputs below this are no emotion: the strongest has to lead from an intensity of 15 % on.
_HEARD = 0.15


def fit_system(examples: Examples, space: Space = "character") -> tuple[FuzzySystem, list[Finding]]:
    """Learn terms and rules from examples.

    Parameters
    ----------
    examples : Examples
    space : {"take", "character"}
        Where their features were measured.

    Returns
    -------
    system : FuzzySystem
        One output for each emotion of the examples.
    findings : list of Finding
        EXPRESSION_UNSEEN for each emotion that gets no rule.
    """
    ways = partings(examples)
    parts = cheapest_partings(examples, words_of(examples, _parts(*ways.values())), ways)
    words = words_of(examples, _parts(parts.values()))
    learned = learn_rules(examples, words, parts)
    learned += learn_hints(examples, words, learned)
    rules = tuple(_rule(rule, words, examples) for rule in learned)
    outputs = tuple(Variable(emotion, "output") for emotion in examples.names)
    inputs = _inputs(learned, words, examples)
    system = FuzzySystem((*inputs, *outputs), rules, space=space, smoothing=LEARNED_SMOOTHING)
    silent = set(examples.names) - {rule.emotion for rule in learned}
    return system, [
        finding("EXPRESSION_UNSEEN", name, f"no few marker motions show {name}; it gets no rule")
        for name in examples.names
        if name in silent
    ]


def _parts(*ways: Iterable[Parting]) -> list[BoolArray]:
    return [part for way in ways for parts in way for part in parts]


def answers(system: FuzzySystem, examples: Examples) -> FloatArray:
    """Return the emotions that a fitted system hears in examples: (N, E)."""
    return answers_to(system, examples.variables, examples.features)


def answers_to(
    system: FuzzySystem, variables: tuple[Variable, ...], features: FloatArray
) -> FloatArray:
    """Return what a fitted system hears in features (N, I) of which it reads some columns."""
    column = {v.name: i for i, v in enumerate(variables)}
    return evaluate(system, features[:, [column[v.name] for v in system.inputs]]).outputs


def heard(outputs: FloatArray, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the strongest emotion of each row of `outputs` (N, E), or `NO_EMOTION`."""
    if not names:
        return (NO_EMOTION,) * len(outputs)
    strongest = np.argmax(outputs, axis=1)
    loud = outputs[np.arange(len(outputs)), strongest] >= _HEARD
    return tuple(names[i] if yes else NO_EMOTION for i, yes in zip(strongest, loud, strict=True))


def _rule(learned: LearnedRule, words: Words, examples: Examples) -> Rule:
    conditions = [
        f"{examples.variables[words.feature[term]].name} IS {'NOT ' * negated}{words.names[term]}"
        for term, negated in learned.conditions
    ]
    return parse_rule(f"IF {' AND '.join(conditions)} THEN {learned.emotion} IS 1", learned.weight)


def _inputs(learned: list[LearnedRule], words: Words, examples: Examples) -> list[Variable]:
    """Return the features that rules ask for, with all their terms of that direction."""
    asked = {
        (int(words.feature[term]), int(np.sign(words.top[term])))
        for rule in learned
        for term, _ in rule.conditions
    }
    return [
        replace(
            examples.variables[feature],
            terms=tuple(
                term
                for sign in (1, -1)
                if (feature, sign) in asked
                for term in words.terms_of(feature, sign)
            ),
        )
        for feature in sorted({feature for feature, _ in asked})
    ]
