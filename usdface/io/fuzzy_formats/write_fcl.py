"""Fuzzy systems to FCL, the Fuzzy Control Language of IEC 61131-7:2000.

The standard's terms are lists of points and singletons. Smooth terms, norms beyond its three and
linear conclusions are written as fuzzylite reads them.
"""

from math import isfinite

from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Term
from usdface.io.fuzzy_formats.fcl_keywords import ACCU, AND, METHODS, OR, SMOOTH
from usdface.io.fuzzy_formats.fll_keywords import FLL_KINDS
from usdface.io.fuzzy_formats.format_limits import (
    check_names,
    check_no_most_of,
    differs,
    kept_in_range,
    repeated_singletons,
)
from usdface.io.fuzzy_formats.metadata_comments import FACE_SETTINGS, notes_of
from usdface.io.fuzzy_formats.rule_text import as_ramp, conclusions, condition_text, output_terms

__all__ = ["fcl_text"]

_STANDARD = {"min", "prod", "lukasiewicz", "max", "probor", "sum"}


def fcl_text(expression: ExpressionSystem, name: str) -> tuple[str, list[Finding]]:
    """Return a system as FCL.

    Raises
    ------
    OutputError
        If a name or a rule cannot be written.
    """
    system = expression.fuzzy
    check_names(system, ".fcl")
    check_no_most_of(system, ".fcl")
    mamdani = system.inference == "mamdani"
    kinds = {t.kind for v in system.variables for t in v.terms}
    beyond = [(system.normalisation == "weighted_sum" and not mamdani, "the weighted sum")]
    conditions = [p for rule in system.rules for p in rule.propositions]
    joined = {system.implication, system.aggregation} if mamdani else set()
    words = [
        (not kinds.isdisjoint({*SMOOTH, "linear"}), "terms that are no lists of points"),
        (any("(" in condition_text(r.antecedent) for r in system.rules), "parentheses"),
        (any({*p.hedges} - {"not"} for p in conditions), "hedges"),
        (bool({system.and_, system.or_, *joined} - _STANDARD), "norms beyond the standard's"),
    ]
    sampled = ("samples", "sampling") if mamdani else ()
    fields = (*FACE_SETTINGS, "normalisation", *sampled)
    lines = [f"// {note}" for note in notes_of(expression, fields)]
    lines += [f"FUNCTION_BLOCK {name}", ""]
    for kind, variables in (("VAR_INPUT", system.inputs), ("VAR_OUTPUT", system.outputs)):
        lines += [kind, *(f"    {v.name} : REAL;" for v in variables), "END_VAR", ""]
    for v in system.inputs:
        ranged = [f"    RANGE := ({v.range[0]!r} .. {v.range[1]!r});"] if v.range else []
        lines += [f"FUZZIFY {v.name}", *ranged, *map(_term, v.terms), "END_FUZZIFY", ""]
    for v in system.outputs:
        lines += [f"DEFUZZIFY {v.name}", f"    RANGE := ({v.span[0]!r} .. {v.span[1]!r});"]
        lines += map(_term, output_terms(system, v))
        lines.append(f"    METHOD : {METHODS[system.defuzzifier] if mamdani else 'COGS'};")
        lines += [f"    ACCU : {ACCU[system.aggregation]};"] if mamdani else []
        lines += [f"    DEFAULT := {v.default!r};", "END_DEFUZZIFY", ""]
    lines += ["RULEBLOCK rules", f"    AND : {AND[system.and_]};", f"    OR : {OR[system.or_]};"]
    lines += [f"    ACT : {AND[system.implication]};"] if mamdani else []
    lines += [f"    RULE {i + 1} : {_rule(rule)};" for i, rule in enumerate(system.rules)]
    lines += ["END_RULEBLOCK", "", "END_FUNCTION_BLOCK"]
    findings = differs(expression, ".fcl", beyond, words)
    if not mamdani:
        findings += kept_in_range(".fcl", system.outputs)
    return "\n".join(lines) + "\n", findings + repeated_singletons(".fcl", system)


def _term(term: Term) -> str:
    p = as_ramp(term).parameters
    kind = as_ramp(term).kind
    if kind == "constant":
        definition = repr(p[0])
    elif kind == "points":
        definition = " ".join(f"({x!r}, {y!r})" for x, y in zip(p[::2], p[1::2], strict=True))
    elif kind in (*SMOOTH, "linear") or not all(map(isfinite, p)):
        definition = f"{FLL_KINDS[kind]} {' '.join(map(repr, p))}"
    else:
        heights = {"ramp": (0, 1) if p[0] < p[1] else (1, 0), "triangular": (0, 1, 0)}
        points = zip(sorted(p), heights.get(kind, (0, 1, 1, 0)), strict=True)
        definition = " ".join(f"({x!r}, {y})" for x, y in points)
    return f"    TERM {term.name} := {definition};"


def _rule(rule: Rule) -> str:
    ends = ", ".join(f"{output} IS {term}" for output, term in conclusions(rule))
    # A rule that is switched off weighs nothing for others; its weight is in the notes.
    weight = rule.weight if rule.enabled else 0.0
    weighted = "" if weight == 1 else f" WITH {weight!r}"
    return f"IF {condition_text(rule.antecedent)} THEN {ends}{weighted}"
