"""Lint of an expression system: its rule base, and the rules that fire on a neutral face."""

import numpy as np

from usdface.advice import advice
from usdface.arrays import FloatArray
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import rules_firing_at
from usdface.fuzzy.lint import rule_findings
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Term

__all__ = ["check_rules", "fires_at_neutral"]

# A face unit is about six centimetres: no marker moves so far. A term that does not reach half of
# its height within it is one in millimetres. A foot far beyond it only leaves a term open there.
_REACH, _REACHED = 1.0, 0.5


def check_rules(system: ExpressionSystem) -> list[Finding]:
    """Return RULE_FIRES_AT_NEUTRAL for each rule that does, TERM_FAR, the lint of the rule base.

    ADVICE_FAILED where the rules cannot be checked.
    """
    found, failed = advice("fuzzy rules", lambda: _check(system), list[Finding]())
    return found + failed


def _check(system: ExpressionSystem) -> list[Finding]:
    neutral = [
        finding(
            "RULE_FIRES_AT_NEUTRAL",
            rule.place or str(rule),
            "the rule {rule} fires on a neutral face; begin its terms away from 0",
            str(rule),
        )
        for rule in fires_at_neutral(system)
    ]
    read = zip(system.fuzzy.inputs, system.features, strict=True)
    lower_bounds = {v.name: 0.0 for v, feature in read if feature.measure == "absolute"}
    return neutral + _far_terms(system) + rule_findings(system.fuzzy, lower_bounds)


def _far_terms(system: ExpressionSystem) -> list[Finding]:
    """Report terms in face units that no motion of a face reaches by half."""
    if system.face_unit == "none":
        return []
    steps = np.linspace(-_REACH, _REACH, 2001)
    message = (
        "no motion of a face, below a face unit of some 6 cm, reaches half of the terms of "
        "{variable}: {names}; if the inputs are in millimetres, set the face unit of the system "
        'to "none"'
    )
    findings = []
    for variable in system.fuzzy.inputs:
        far = [
            term.name
            for term in variable.terms
            if membership(term.kind, term.parameters, _within(steps, term)).max() < _REACHED
        ]
        if far:
            findings.append(finding("TERM_FAR", variable.name, message, variable.name, far))
    return findings


def _within(steps: FloatArray, term: Term) -> FloatArray:
    """Return places to examine a term at: also its own, where it is narrower than the steps."""
    own = [place for place in places(term.kind, term.parameters) if abs(place) <= _REACH]
    return np.concatenate([steps, own])


def fires_at_neutral(system: ExpressionSystem) -> list[Rule]:
    """Return the enabled rules that fire on a neutral face, where every feature is 0."""
    return rules_firing_at(system.fuzzy, np.zeros(len(system.features)))
