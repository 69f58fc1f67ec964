"""Fuzzy systems to FLL: one ``key: value`` a line, indented under its block."""

from math import inf

from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.fll_keywords import DEFUZZIFIERS, FLL_KINDS, S_NORMS, T_NORMS
from usdface.io.fuzzy_formats.format_limits import (
    check_names,
    check_no_group_negated,
    check_no_most_of,
    differs,
)
from usdface.io.fuzzy_formats.metadata_comments import FACE_SETTINGS, notes_of
from usdface.io.fuzzy_formats.rule_text import conclusions, condition_text, output_terms

__all__ = ["fll_text"]


def fll_text(expression: ExpressionSystem, name: str) -> tuple[str, list[Finding]]:
    """Return a system as FLL.

    Raises
    ------
    OutputError
        If a name or a rule cannot be written.
    """
    system = expression.fuzzy
    check_names(system, ".fll")
    check_no_most_of(system, ".fll")
    check_no_group_negated(system, ".fll")
    mamdani = system.inference == "mamdani"
    beyond = [
        (mamdani and system.sampling == "ends", "samples at the ends of the range"),
    ]
    settings = (*FACE_SETTINGS, "normalisation", *(("sampling",) if mamdani else ()))
    lines = [f"# {note}" for note in notes_of(expression, settings)]
    lines.append(f"Engine: {name}")
    for v in system.inputs:
        low, high = v.range or (-inf, inf)
        lines += _block("InputVariable", v.name, low, high, "false")
        lines += [_term(term) for term in v.terms]
    for v in system.outputs:
        lines += _block("OutputVariable", v.name, *v.span, "true")
        lines += [f"  {key}: {value}" for key, value in _output(system, v).items()]
        lines += [_term(term) for term in output_terms(system, v)]
    lines += ["RuleBlock: rules", "  enabled: true"]
    lines += [f"  conjunction: {T_NORMS[system.and_]}", f"  disjunction: {S_NORMS[system.or_]}"]
    lines.append(f"  implication: {T_NORMS[system.implication] if mamdani else 'none'}")
    lines.append("  activation: General")
    lines += [f"  rule: {_rule(rule)}" for rule in system.rules]
    return "\n".join(lines) + "\n", differs(expression, ".fll", beyond)


def _block(kind: str, name: str, low: float, high: float, locked: str) -> list[str]:
    return [
        f"{kind}: {name}",
        "  enabled: true",
        f"  range: {low!r} {high!r}",
        f"  lock-range: {locked}",
    ]


def _output(system: FuzzySystem, output: Variable) -> dict[str, str]:
    mamdani = system.inference == "mamdani"
    how = "WeightedSum" if system.normalisation == "weighted_sum" else "WeightedAverage"
    return {
        "aggregation": S_NORMS[system.aggregation] if mamdani else "none",
        "defuzzifier": f"{DEFUZZIFIERS[system.defuzzifier]} {system.samples}"
        if mamdani
        else f"{how} TakagiSugeno",
        "default": repr(output.default),
        "lock-previous": "false",
    }


def _term(term: Term) -> str:
    return f"  term: {term.name} {FLL_KINDS[term.kind]} {' '.join(map(repr, term.parameters))}"


def _rule(rule: Rule) -> str:
    ends = " and ".join(f"{output} is {term}" for output, term in conclusions(rule))
    # A rule that is switched off weighs nothing for others; its weight is in the notes.
    weight = rule.weight if rule.enabled else 0.0
    weighted = "" if weight == 1 else f" with {weight!r}"
    condition = condition_text(rule.antecedent, str.lower)
    # Parentheses are words of their own there.
    condition = condition.replace("(", "( ").replace(")", " )")
    return f"if {condition} then {ends}{weighted}"
