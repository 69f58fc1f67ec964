"""Lint of a rule base: rules that cannot fire, contradict one another or leave ranges uncovered."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.norms import HEDGES
from usdface.fuzzy.rules import Condition, Proposition, Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable

__all__ = ["rule_findings"]

# A condition with more alternatives than this is taken to hold somewhere, as is one of parts that
# would have to be put together in more ways.
_ALTERNATIVES, _PAIRS = 256, 4096
_SAMPLES = 1001


def rule_findings(
    system: FuzzySystem, lower_bounds: Mapping[str, float] = MappingProxyType({})
) -> list[Finding]:
    """Return the doubtful rules of a system.

    RULE_UNREACHABLE, RULE_OFF, RULES_CONTRADICT and RANGE_UNCOVERED (only inputs that have a
    range).

    Parameters
    ----------
    system : FuzzySystem
    lower_bounds : mapping of str to float
        Values that inputs cannot fall below, e.g. 0 for a distance.
    """
    return [*_silent(system, lower_bounds), *_contradictions(system), *_gaps(system)]


def _silent(system: FuzzySystem, lower_bounds: Mapping[str, float]) -> list[Finding]:
    findings = []
    points = {v.name: _points(v, lower_bounds.get(v.name, -np.inf)) for v in system.inputs}
    variables = {v.name: v for v in system.inputs}
    for rule in system.rules:
        where = rule.place or str(rule)
        if not rule.enabled or rule.weight == 0:
            off = "is switched off" if not rule.enabled else "weighs 0"
            findings.append(finding("RULE_OFF", where, f"the rule {rule} {off}"))
        elif not _alternatives(rule.condition, variables, points, False):
            why = (
                "can never fire: no value that its inputs may have belongs to all that it asks; "
                "drop or change one of these conditions"
            )
            findings.append(finding("RULE_UNREACHABLE", where, f"the rule {rule} {why}"))
    return findings


def _alternatives(
    condition: Condition,
    variables: dict[str, Variable],
    points: dict[str, FloatArray],
    negated: bool,
) -> list[dict[str, BoolArray]]:
    """Return the ways in which a condition can hold: for each variable, at which points.

    Whether two variables can have their values together is not asked: they are free. Where
    there are too many ways, one that asks for nothing stands for all.
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
    if (condition.how == "or") != negated:
        ways = [way for part in parts for way in part]
        return ways if len(ways) <= _ALTERNATIVES else [{}]
    ways = [{}]
    for part in parts:
        if len(ways) * len(part) > _PAIRS:
            ways = [{}]
            continue
        joined = [_together(a, b) for a in ways for b in part]
        ways = [way for way in joined if all(at.any() for at in way.values())]
        ways = ways if len(ways) <= _ALTERNATIVES else [{}]
    return ways


def _together(a: dict[str, BoolArray], b: dict[str, BoolArray]) -> dict[str, BoolArray]:
    return a | {name: at & a[name] if name in a else at for name, at in b.items()}


def _contradictions(system: FuzzySystem) -> list[Finding]:
    """Compare each rule with the first that asks for the same and speaks of the same output."""
    findings = []
    first: dict[object, tuple[Rule, float | str]] = {}
    for rule in system.rules:
        if not rule.enabled or rule.weight == 0:
            continue
        asks = _meaning(rule.condition)
        for output, value in rule.consequents:
            other, said = first.setdefault((asks, output), (rule, value))
            if said != value:
                message = (
                    f"the rules {other} and {rule} ask for the same, but say {output} IS {said} "
                    f"and {value}; keep one, or tell their conditions apart"
                )
                findings.append(finding("RULES_CONTRADICT", rule.place or str(rule), message))
    return findings


def _meaning(condition: Condition) -> object:
    """A condition without the order of its parts."""
    if isinstance(condition, Proposition):
        return condition
    return condition.how, frozenset(_meaning(part) for part in condition.parts)


def _gaps(system: FuzzySystem) -> list[Finding]:
    findings = []
    for variable in system.inputs:
        if variable.range is None or not variable.terms:
            continue
        bare = _bare(variable, *variable.range)
        if bare:
            message = (
                f"no term of {variable.name} covers {' and '.join(bare)}; no rule about it fires "
                "there; widen a term or shorten the range"
            )
            findings.append(finding("RANGE_UNCOVERED", variable.name, message))
    return findings


def _bare(variable: Variable, low: float, high: float) -> list[str]:
    """Return the parts of a range that no term covers, from left to right."""
    x = np.linspace(low, high, _SAMPLES)
    covered = np.any([membership(t.kind, t.parameters, x) > 0 for t in variable.terms], axis=0)
    covered[[0, -1]] = True  # the ends alone, where terms have their feet, are no gap
    edges = np.flatnonzero(np.diff(covered)).reshape(-1, 2)
    # Where terms end is a parameter of theirs, a little before or after the samples.
    marks = np.array([low, high, *_marks(variable)])
    found = []
    for before, last in edges:
        begin, end = marks[marks <= x[before + 1]].max(), marks[marks >= x[last]].min()
        found.append(f"{begin:g} to {end:g}")
    return found


def _points(variable: Variable, least: float) -> FloatArray:
    """Values that a variable can have, between which no term changes from 0 to more."""
    low, high = variable.range or (-np.inf, np.inf)
    low = max(low, least)
    marks = np.unique([0.0, low, high, *_marks(variable)])
    marks = marks[np.isfinite(marks)]
    beyond = [marks[0] - 1.0, marks[-1] + 1.0]
    points = np.concatenate([marks, (marks[1:] + marks[:-1]) / 2, beyond])
    return np.asarray(points[(points >= low) & (points <= high)])


def _marks(variable: Variable) -> list[float]:
    """Return where the terms of a variable bend, begin and end."""
    return [p for term in variable.terms for p in places(term.kind, term.parameters)]
