"""Fuzzy systems to MATLAB's .fis: sections of ``key=value``, rules as indices of terms."""

from collections.abc import Iterable, Sequence

from usdface.errors import OutputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.fuzzy.membership import places
from usdface.fuzzy.rules import Combined, Proposition, Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.fis_keywords import (
    AGGREGATIONS,
    AND,
    DEFUZZIFIERS,
    KINDS,
    MATLABS_SAMPLES,
    OR,
    counts_from_0,
)
from usdface.io.fuzzy_formats.format_limits import (
    check_names,
    check_no_most_of,
    differs,
    kept_in_range,
)
from usdface.io.fuzzy_formats.metadata_comments import FACE_SETTINGS, notes_of
from usdface.io.fuzzy_formats.rule_text import as_ramp, conclusions, output_terms

__all__ = ["fis_text"]

# Names in findings of settings that the format does not hold.
_CALLED = {"and_": "the norm of AND", "or_": "the norm of OR", "samples": "the number of samples"}


def fis_text(expression: ExpressionSystem, name: str) -> tuple[str, list[Finding]]:
    """Return a system as .fis.

    Raises
    ------
    OutputError
        If a name or a rule cannot be written: the format has rules of ANDs or of ORs, each
        variable once, with NOT and no other hedge.
    """
    system = expression.fuzzy
    check_names(system, ".fis")
    check_no_most_of(system, ".fis")
    mamdani = system.inference == "mamdani"
    sampled = (system.samples, system.sampling) == (MATLABS_SAMPLES, "ends")
    beyond = {
        "and_": system.and_ not in AND,
        "or_": system.or_ not in OR,
        "normalisation": mamdani or system.normalisation == "all_rules",
        "implication": mamdani and system.implication not in AND,
        "aggregation": mamdani and system.aggregation not in AGGREGATIONS,
        "samples": mamdani and not sampled,
        "sampling": mamdani and not sampled,
    }
    lost = [field for field, here in beyond.items() if here]
    middle = any(v.default != sum(v.span) / 2 for v in system.outputs)
    notes = notes_of(expression, (*FACE_SETTINGS, *lost), ranges=True, defaults=middle)
    lines = [f"% {note}" for note in notes] + ["[System]", f"Name='{name}'"]
    lines += [f"{key}={value}" for key, value in _settings(system).items()]
    terms = {v.name: output_terms(system, v) for v in system.outputs}
    terms |= {v.name: v.terms for v in system.inputs}
    for kind, variables in (("Input", system.inputs), ("Output", system.outputs)):
        for i, v in enumerate(variables):
            lines += ["", f"[{kind}{i + 1}]", f"Name='{v.name}'", f"Range={_list(_range(v))}"]
            lines.append(f"NumMFs={len(terms[v.name])}")
            lines += [f"MF{k + 1}={_term(term)}" for k, term in enumerate(terms[v.name])]
    lines += ["", "[Rules]", *(_rule(system, rule, terms) for rule in system.rules)]
    missing = [(True, _CALLED.get(f, f)) for f in lost if f != "normalisation"]
    missing.append((middle, "the defaults of outputs"))
    missing.append((counts_from_0(system), "maxima below 0"))
    findings = differs(expression, ".fis", missing)
    if not mamdani:
        findings += kept_in_range(".fis", system.outputs)
    return "\n".join(lines) + "\n", findings


def _settings(system: FuzzySystem) -> dict[str, object]:
    mamdani = system.inference == "mamdani"
    average = "wtsum" if system.normalisation == "weighted_sum" else "wtaver"
    return {
        "Type": f"'{system.inference}'",
        "Version": "2.0",
        "NumInputs": len(system.inputs),
        "NumOutputs": len(system.outputs),
        "NumRules": len(system.rules),
        "AndMethod": f"'{AND.get(system.and_, 'min')}'",
        "OrMethod": f"'{OR.get(system.or_, 'max')}'",
        "ImpMethod": f"'{AND.get(system.implication, 'min') if mamdani else 'prod'}'",
        "AggMethod": f"'{AGGREGATIONS.get(system.aggregation, 'max') if mamdani else 'sum'}'",
        "DefuzzMethod": f"'{DEFUZZIFIERS[system.defuzzifier] if mamdani else average}'",
    }


def _range(variable: Variable) -> tuple[float, float]:
    """The format wants a range; without one it is where the terms' parameters lie."""
    if variable.range or variable.kind == "output":
        return variable.span
    marks = [p for term in variable.terms for p in places(term.kind, term.parameters)] or [0.0]
    low, high = min(marks), max(marks)
    room = (high - low) / 4 or 1.0
    return low - room, high + room


def _term(term: Term) -> str:
    term = as_ramp(term)
    p = term.parameters
    if term.kind == "ramp":
        kind, values = ("linsmf", p) if p[0] < p[1] else ("linzmf", p[::-1])
    elif term.kind in KINDS:
        kind, order = KINDS[term.kind]
        values = tuple(p[i] for i in order)
    elif term.kind == "points":
        raise OutputError(
            f"the term {term.name!r} is a list of points, which .fis has not; make it a triangle "
            "or a trapezium, or write .fcl or .fll"
        )
    else:
        kind, values = term.kind, p
    return f"'{term.name}':'{kind}',{_list(values)}"


def _list(values: Iterable[float]) -> str:
    return f"[{' '.join(repr(v).replace('inf', 'Inf').removesuffix('.0') for v in values)}]"


def _rule(system: FuzzySystem, rule: Rule, terms: dict[str, tuple[Term, ...]]) -> str:
    antecedent = rule.antecedent
    parts = antecedent.parts if isinstance(antecedent, Combined) else (antecedent,)
    inputs: dict[str, int] = {}
    for part in parts:
        if not isinstance(part, Proposition) or part.hedges not in ((), ("not",)):
            raise OutputError(
                f"rule {rule}: .fis has ANDs or ORs of terms, with NOT and no other hedge; "
                "split the rule, or write .fll"
            )
        if part.variable in inputs:
            raise OutputError(
                f"rule {rule}: .fis asks each variable once, this rule asks {part.variable} "
                "twice; make one term of both, or write .fll"
            )
        place = _place(terms[part.variable], part.term)
        inputs[part.variable] = -place if part.hedges else place
    consequents = {output: _place(terms[output], term) for output, term in conclusions(rule)}
    joined = 2 if isinstance(antecedent, Combined) and antecedent.how == "or" else 1
    ins = " ".join(str(inputs.get(v.name, 0)) for v in system.inputs)
    outs = " ".join(str(consequents.get(v.name, 0)) for v in system.outputs)
    weight = rule.weight if rule.enabled else 0.0
    return f"{ins}, {outs} ({repr(weight).removesuffix('.0')}) : {joined}"


def _place(terms: Sequence[Term], name: str) -> int:
    return [term.name for term in terms].index(name) + 1
