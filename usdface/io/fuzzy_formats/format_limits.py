"""Limits of the file formats, and differences in evaluation by other programs."""

import re
from collections.abc import Iterable, Sequence

from usdface.errors import OutputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding, finding
from usdface.fuzzy.rules import Combined, Condition
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable

__all__ = [
    "check_names",
    "check_no_group_negated",
    "check_no_most_of",
    "differs",
    "kept_in_range",
    "repeated_singletons",
]


def check_names(system: FuzzySystem, suffix: str) -> None:
    """Refuse terms whose names the format cannot hold.

    Raises
    ------
    OutputError
        With the name.
    """
    for variable in system.variables:
        for term in variable.terms:
            if not re.fullmatch(r"[^\W\d]\w*", term.name):
                raise OutputError(
                    f"the term {term.name!r} of {variable.name} cannot be written to {suffix}: "
                    "names there are letters, digits and _; rename it"
                )


def check_no_group_negated(system: FuzzySystem, suffix: str) -> None:
    """Refuse NOT before parentheses, which most formats have not.

    Raises
    ------
    OutputError
        With the rule.
    """
    for rule in system.rules:
        if _negates(rule.antecedent):
            raise OutputError(
                f"rule {rule}: {suffix} has no NOT (...); say it with IS NOT, or write .fcl"
            )


def check_no_most_of(system: FuzzySystem, suffix: str) -> None:
    """Refuse MOST OF: the formats of other programs join conditions by AND and OR alone.

    Raises
    ------
    OutputError
        With the rule.
    """
    for rule in system.rules:
        if _counts(rule.antecedent):
            raise OutputError(
                f"rule {rule}: {suffix} has no MOST OF (...), an ordered weighted average; join "
                "the conditions by AND, or write .usda"
            )


def _counts(condition: Condition) -> bool:
    return isinstance(condition, Combined) and (
        condition.how == "most" or any(map(_counts, condition.parts))
    )


def _negates(condition: Condition) -> bool:
    return isinstance(condition, Combined) and (
        condition.how == "not" or any(map(_negates, condition.parts))
    )


def differs(
    expression: ExpressionSystem,
    suffix: str,
    beyond: Sequence[tuple[bool, str]],
    words: Sequence[tuple[bool, str]] = (),
) -> list[Finding]:
    """Return a MEANING_DIFFERS for all that another program would evaluate differently.

    `beyond` lists features that this format lacks: whether the system has each, and its name;
    `words` likewise lists keywords that are not in the format's standard, for a second finding.
    """
    system = expression.fuzzy
    sugeno = system.inference == "sugeno"
    common = [
        (system.else_rule, "the neutral rule"),
        (sugeno and system.normalisation == "all_rules", "the normalisation over all rules"),
        (expression.face_unit != "none", "features in face units"),
    ]
    lost_features = (
        ([*common, *beyond], "only as comments that usdface reads; another program evaluates"),
        (words, "in words that its standard does not have; a program refuses them or evaluates"),
    )
    findings = []
    for group, how in lost_features:
        names = [name for here, name in group if here]
        if names:
            message = f"{suffix} holds {{features}} {how} the system differently"
            findings.append(finding("MEANING_DIFFERS", suffix, message, names))
    return findings


def kept_in_range(where: str, outputs: Iterable[Variable]) -> list[Finding]:
    """Return a MEANING_DIFFERS for each output whose terms may leave its range.

    Ours are kept in it, those of the other program are not.
    """
    findings = []
    for v in outputs:
        low, high = v.span
        free = any(t.kind == "linear" for t in v.terms) or any(
            not low <= t.parameters[0] <= high for t in v.terms if t.kind == "constant"
        )
        if free:
            message = "the outputs of {variable} are clipped to its range, {low:g} to {high:g}"
            findings.append(
                finding("MEANING_DIFFERS", f"{where}: {v.name}", message, v.name, low, high)
            )
    return findings


def repeated_singletons(where: str, system: FuzzySystem) -> list[Finding]:
    """Return a MEANING_DIFFERS for each output of a Sugeno system that rules give a value twice.

    Their firing strengths are added here; IEC 61131-7, jFuzzyLogic and fuzzylite from version 8 on
    first join them to one by the aggregation.
    """
    if system.inference != "sugeno" or system.aggregation == "sum":
        return []
    findings = []
    for v in system.outputs:
        values = [
            v.term(value).parameters if isinstance(value, str) else (value,)
            for rule in system.rules
            if rule.enabled and rule.weight
            for name, value in rule.consequents
            if name == v.name
        ]
        if len(set(values)) < len(values):
            message = (
                "several rules conclude with the same value of {variable}; their firing strengths "
                "are added, while other programs join them by the aggregation, mostly the largest"
            )
            findings.append(finding("MEANING_DIFFERS", f"{where}: {v.name}", message, v.name))
    return findings
