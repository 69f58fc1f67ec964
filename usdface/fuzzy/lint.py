"""Lint of a rule base: rules that cannot fire, contradict one another or leave ranges uncovered."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.norms import HEDGES, most_weights
from usdface.fuzzy.rules import Condition, Proposition, Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable

__all__ = ["rule_findings"]

# A condition with more alternatives than this counts as satisfiable, as does one with more
# combinations of its parts' alternatives.
_ALTERNATIVES, _PAIRS = 256, 4096
_SAMPLES = 1001


def rule_findings(
    system: FuzzySystem, lower_bounds: Mapping[str, float] = MappingProxyType({})
) -> list[Finding]:
    """Return the lint of a rule base.

    RULE_UNREACHABLE, RULE_OFF, RULES_CONTRADICT, OUTPUT_WITHOUT_RULE and RANGE_UNCOVERED (only
    inputs that have a range).

    Parameters
    ----------
    system : FuzzySystem
    lower_bounds : mapping of str to float
        Values that inputs cannot fall below, e.g. 0 for a distance.
    """
    return [
        *_unreachable(system, lower_bounds),
        *_contradictions(system),
        *_without_rule(system),
        *_gaps(system),
    ]


def _unreachable(system: FuzzySystem, lower_bounds: Mapping[str, float]) -> list[Finding]:
    findings = []
    points = {v.name: _points(v, lower_bounds.get(v.name, -np.inf)) for v in system.inputs}
    variables = {v.name: v for v in system.inputs}
    for rule in system.rules:
        where = rule.place or str(rule)
        if not rule.enabled or rule.weight == 0:
            off = "weighs 0" if rule.enabled else "is switched off"
            message = f"the rule {{rule}} {off}"
            findings.append(finding("RULE_OFF", where, message, rule, enabled=rule.enabled))
        elif not _alternatives(rule.antecedent, variables, points, False):
            message = (
                "the rule {rule} can never fire: no value in the ranges of its inputs meets all "
                "its conditions; drop or change one of these conditions"
            )
            findings.append(finding("RULE_UNREACHABLE", where, message, rule))
    return findings


def _alternatives(
    condition: Condition,
    variables: dict[str, Variable],
    points: dict[str, FloatArray],
    negated: bool,
) -> list[dict[str, BoolArray]]:
    """Return the alternatives in which a condition holds: for each variable, its points.

    Variables count as independent. Too many alternatives are replaced by an empty one, which
    always holds.
    """
    if isinstance(condition, Proposition):
        variable = variables[condition.variable]
        term, x = variable.term(condition.term), points[condition.variable]
        degree = membership(term.kind, term.parameters, x)
        for hedge in (*(("not",) if negated else ()), *condition.hedges)[::-1]:
            degree = HEDGES[hedge](degree)
        return [{condition.variable: degree > 0}] if (degree > 0).any() else []
    if condition.how == "not":
        return _alternatives(condition.parts[0], variables, points, not negated)
    parts = [_alternatives(part, variables, points, negated) for part in condition.parts]
    if condition.how == "most":
        # More than the share at which it begins must hold; any of them, so nothing is ruled out.
        enough = sum(map(bool, parts)) > np.flatnonzero(most_weights(len(parts)))[0]
        return [{}] if negated or enough else []
    if (condition.how == "or") != negated:
        alternatives = [alternative for part in parts for alternative in part]
        return alternatives if len(alternatives) <= _ALTERNATIVES else [{}]
    alternatives = [{}]
    for part in parts:
        if len(alternatives) * len(part) > _PAIRS:
            alternatives = [{}]
            continue
        joined = [_together(a, b) for a in alternatives for b in part]
        alternatives = [
            alternative for alternative in joined if all(at.any() for at in alternative.values())
        ]
        alternatives = alternatives if len(alternatives) <= _ALTERNATIVES else [{}]
    return alternatives


def _together(a: dict[str, BoolArray], b: dict[str, BoolArray]) -> dict[str, BoolArray]:
    return a | {name: at & a[name] if name in a else at for name, at in b.items()}


def _contradictions(system: FuzzySystem) -> list[Finding]:
    """Compare each rule with the first one of the same antecedent and output."""
    findings = []
    first: dict[object, tuple[Rule, float | str]] = {}
    for rule in system.rules:
        if not rule.enabled or rule.weight == 0:
            continue
        antecedent = _canonical(rule.antecedent)
        for output, value in rule.consequents:
            other, first_value = first.setdefault((antecedent, output), (rule, value))
            if first_value != value:
                message = (
                    "the rules {other_rule} and {rule} have the same antecedent, but conclude "
                    "{output} IS {other_value} and {value}; keep one, or change a condition"
                )
                findings.append(
                    finding(
                        "RULES_CONTRADICT",
                        rule.place or str(rule),
                        message,
                        str(other),
                        str(rule),
                        output,
                        first_value,
                        value,
                    )
                )
    return findings


def _canonical(condition: Condition) -> object:
    """A condition without the order of its parts."""
    if isinstance(condition, Proposition):
        return condition
    return condition.how, frozenset(_canonical(part) for part in condition.parts)


def _without_rule(system: FuzzySystem) -> list[Finding]:
    """Compare outputs with the conclusions of rules, also of those that are switched off."""
    concluded = {output for rule in system.rules for output, _ in rule.consequents}
    message = "no rule concludes {names}; an output without a rule keeps its default"
    names = [each.name for each in system.outputs if each.name not in concluded]
    return [finding("OUTPUT_WITHOUT_RULE", "", message, names)] if names else []


def _gaps(system: FuzzySystem) -> list[Finding]:
    findings = []
    for variable in system.inputs:
        if variable.range is None or not variable.terms:
            continue
        uncovered = _uncovered(variable, *variable.range)
        if uncovered:
            message = (
                "no term of {variable} covers {ranges}; no rule fires there; widen a term or "
                "shorten the range"
            )
            findings.append(
                finding("RANGE_UNCOVERED", variable.name, message, variable.name, uncovered)
            )
    return findings


def _uncovered(variable: Variable, low: float, high: float) -> list[str]:
    """Return the parts of a range that no term covers, from left to right."""
    x = np.linspace(low, high, _SAMPLES)
    covered = np.any([membership(t.kind, t.parameters, x) > 0 for t in variable.terms], axis=0)
    covered[[0, -1]] = True  # the ends alone, where terms have their feet, are no gap
    edges = np.flatnonzero(np.diff(covered)).reshape(-1, 2)
    # Terms end at their parameters, a little before or after the samples.
    marks = np.array([low, high, *_marks(variable)])
    found = []
    for before, last in edges:
        begin, end = marks[marks <= x[before + 1]].max(), marks[marks >= x[last]].min()
        found.append(f"{begin:g} to {end:g}")
    return found


def _points(variable: Variable, least: float) -> FloatArray:
    """Return values of a variable, between which no term changes from 0 to more."""
    low, high = variable.range or (-np.inf, np.inf)
    low = max(low, least)
    marks = np.unique([0.0, low, high, *_marks(variable)])
    marks = marks[np.isfinite(marks)]
    beyond = [marks[0] - 1.0, marks[-1] + 1.0]
    points = np.concatenate([marks, (marks[1:] + marks[:-1]) / 2, beyond])
    return np.asarray(points[(points >= low) & (points <= high)])


def _marks(variable: Variable) -> list[float]:
    """Return the parameters at which the terms of a variable bend, begin and end."""
    return [p for term in variable.terms for p in places(term.kind, term.parameters)]
