"""MATLAB's .fis: sections of ``key=value``, rules as indices of terms.

MathWorks, Fuzzy Logic Toolbox User's Guide, "Fuzzy Inference System file".
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, Literal, TypeVar

from usdface.errors import InputError, OutputError
from usdface.findings import Finding, finding
from usdface.fuzzy.rules import KEYWORDS, Combined, Proposition, Rule, rule_name
from usdface.fuzzy.system import FuzzySystem, Term, Variable
from usdface.io.fuzzy_formats.notes import (
    FACE_SETTINGS,
    Draft,
    check_names,
    differs,
    finish,
    guessed_input,
    notes_of,
    read_text,
)
from usdface.io.fuzzy_formats.rule_text import as_ramp, conclusions, output_terms

__all__ = ["fis_text", "read_fis"]

# For each kind: MATLAB's name, and where its parameters stand among ours.
_KINDS: dict[str, tuple[str, tuple[int, ...]]] = {
    "triangular": ("trimf", (0, 1, 2)),
    "trapezoidal": ("trapmf", (0, 1, 2, 3)),
    "gaussian": ("gaussmf", (1, 0)),
    "gaussian_pair": ("gauss2mf", (1, 0, 3, 2)),
    "sigmoid": ("sigmf", (1, 0)),
    "bell": ("gbellmf", (1, 2, 0)),
    "s_shape": ("smf", (0, 1)),
    "z_shape": ("zmf", (0, 1)),
    "pi_shape": ("pimf", (0, 1, 2, 3)),
}
_AND = {"min": "min", "prod": "prod"}
_OR = {"max": "max", "probor": "probor"}
_AGGREGATIONS = {"max": "max", "probor": "probor", "sum": "sum"}
_DEFUZZIFIERS = {
    "centroid": "centroid",
    "bisector": "bisector",
    "mean_of_max": "mom",
    "smallest_of_max": "som",
    "largest_of_max": "lom",
}
_MATLABS_SAMPLES = 101

_Made = TypeVar("_Made")
Section = dict[str, tuple[int, str]]


def fis_text(system: FuzzySystem, name: str) -> tuple[str, list[Finding]]:
    """Return a system as .fis.

    Raises
    ------
    OutputError
        If a name or a rule cannot be written: the format has rules of ANDs or of ORs, each
        variable once, with NOT and no other hedge.
    """
    check_names(system, ".fis")
    mamdani = system.inference == "mamdani"
    sampled = (system.samples, system.sampling) == (_MATLABS_SAMPLES, "ends")
    beyond = {
        "and_": system.and_ not in _AND,
        "or_": system.or_ not in _OR,
        "normalisation": mamdani or system.normalisation == "all_rules",
        "implication": mamdani and system.implication not in _AND,
        "aggregation": mamdani and system.aggregation not in _AGGREGATIONS,
        "samples": mamdani and not sampled,
        "sampling": mamdani and not sampled,
    }
    lost = [field for field, here in beyond.items() if here]
    middle = any(v.default != sum(v.span) / 2 for v in system.outputs)
    notes = notes_of(system, (*FACE_SETTINGS, *lost), ranges=True, defaults=middle)
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
    missing = [(True, field.strip("_")) for field in lost if field != "normalisation"]
    missing.append((middle, "the defaults of outputs"))
    return "\n".join(lines) + "\n", differs(system, ".fis", missing)


def _settings(system: FuzzySystem) -> dict[str, object]:
    mamdani = system.inference == "mamdani"
    average = "wtsum" if system.normalisation == "weighted_sum" else "wtaver"
    return {
        "Type": f"'{system.inference}'",
        "Version": "2.0",
        "NumInputs": len(system.inputs),
        "NumOutputs": len(system.outputs),
        "NumRules": len(system.rules),
        "AndMethod": f"'{_AND.get(system.and_, 'min')}'",
        "OrMethod": f"'{_OR.get(system.or_, 'max')}'",
        "ImpMethod": f"'{_AND.get(system.implication, 'min') if mamdani else 'prod'}'",
        "AggMethod": f"'{_AGGREGATIONS.get(system.aggregation, 'max') if mamdani else 'sum'}'",
        "DefuzzMethod": f"'{_DEFUZZIFIERS[system.defuzzifier] if mamdani else average}'",
    }


def _range(variable: Variable) -> tuple[float, float]:
    """The format wants a range; without one it is where the terms' parameters lie."""
    if variable.range or variable.kind == "output":
        return variable.span
    marks = [p for term in variable.terms for p in term.parameters if isfinite(p)] or [0.0]
    return min(marks) - 1.0, max(marks) + 1.0


def _term(term: Term) -> str:
    term = as_ramp(term)
    p = term.parameters
    if term.kind == "ramp":
        kind, values = ("linsmf", p) if p[0] < p[1] else ("linzmf", p[::-1])
    elif term.kind in _KINDS:
        kind, order = _KINDS[term.kind]
        values = tuple(p[i] for i in order)
    else:
        kind, values = term.kind, p
    return f"'{term.name}':'{kind}',{_list(values)}"


def _list(values: Iterable[float]) -> str:
    return f"[{' '.join(repr(v).replace('inf', 'Inf').removesuffix('.0') for v in values)}]"


def _rule(system: FuzzySystem, rule: Rule, terms: dict[str, tuple[Term, ...]]) -> str:
    condition = rule.condition
    parts = condition.parts if isinstance(condition, Combined) else (condition,)
    asked: dict[str, int] = {}
    for part in parts:
        if not isinstance(part, Proposition) or part.hedges not in ((), ("not",)):
            raise OutputError(
                f"rule {rule}: .fis has ANDs or ORs of terms, with NOT and no other hedge; "
                "split the rule, or write .fll"
            )
        if part.variable in asked:
            raise OutputError(
                f"rule {rule}: .fis asks each variable once, this rule asks {part.variable} "
                "twice; make one term of both, or write .fll"
            )
        place = _place(terms[part.variable], part.term)
        asked[part.variable] = -place if part.hedges else place
    said = {output: _place(terms[output], term) for output, term in conclusions(rule)}
    joined = 2 if isinstance(condition, Combined) and condition.how == "or" else 1
    ins = " ".join(str(asked.get(v.name, 0)) for v in system.inputs)
    outs = " ".join(str(said.get(v.name, 0)) for v in system.outputs)
    weight = rule.weight if rule.enabled else 0.0
    return f"{ins}, {outs} ({repr(weight).removesuffix('.0')}) : {joined}"


def _place(terms: Sequence[Term], name: str) -> int:
    return [term.name for term in terms].index(name) + 1


def read_fis(path: Path) -> tuple[FuzzySystem, list[Finding]]:
    """Read a system from .fis.

    Raises
    ------
    InputError
        If it is no .fis, or has what our systems have not; the message names the line.
    """
    sections, notes = _sections(path.name, read_text(path))
    findings: list[Finding] = []
    system = sections.get("System", {})
    if not system:
        raise InputError(f"{path.name} has no [System] section; it is no fuzzy system of MATLAB")
    variables: list[Variable] = []
    for kind in ("Input", "Output"):
        count = sum(1 for name in sections if re.fullmatch(rf"{kind}\d+", name))
        _announced(path.name, system, f"Num{kind}s", count)
        for i in range(count):
            section = sections.get(f"{kind}{i + 1}")
            if section is None:
                raise InputError(f"{path.name} has {count} {kind} sections but no [{kind}{i + 1}]")
            taken = [v.name for v in variables]
            variables.append(_read_variable(path.name, kind.lower(), section, taken, findings))
    rules = [
        replace(
            _at(path.name, line, partial(_read_rule, text, variables)),
            place=f"{path.name}, line {line}",
        )
        for line, text in sections.get("Rules", {}).values()
    ]
    _announced(path.name, system, "NumRules", len(rules))
    settings = _read_settings(path.name, system)
    draft = Draft(tuple(variables), tuple(rules), settings, tuple(notes), tuple(findings))
    return finish(path, draft)


def _sections(name: str, text: str) -> tuple[dict[str, Section], list[tuple[int, str]]]:
    """Return the lines of each section by key (rules by number), and the notes."""
    sections: dict[str, Section] = {}
    notes = []
    current: Section | None = None
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith("%"):
            comment = line.lstrip("% ")
            if comment.startswith("usdface:"):
                notes.append((number, comment.removeprefix("usdface:")))
        elif match := re.fullmatch(r"\[(\w+)\]", line):
            if match[1] in sections:
                raise InputError(f"{name}, line {number}: a second [{match[1]}]; merge them")
            current = sections.setdefault(match[1], {})
        elif line and current is None:
            raise InputError(f"{name}, line {number}: expected [System], found {line[:40]!r}")
        elif line and current is not None:
            key, equals, value = line.partition("=")
            key = key.strip() if equals else f"rule {number}"
            if key in current:
                raise InputError(f"{name}, line {number}: a second {key}; remove one")
            current[key] = (number, value.strip() if equals else line)
    return sections, notes


def _at(name: str, line: int, make: Callable[[], _Made]) -> _Made:
    """Name file and line in an error of `make`."""
    try:
        return make()
    except InputError as error:
        raise InputError(f"{name}, line {line}: {error}") from error


def _announced(name: str, section: Section, key: str, count: int) -> None:
    line, text = section.get(key, (0, str(count)))
    if text != str(count):
        raise InputError(
            f"{name}, line {line}: {key} is {text}, but there are {count}; the file is cut off "
            "or was edited"
        )


def _read_settings(name: str, section: Section) -> dict[str, Any]:
    def one(key: str, table: dict[str, str], default: str) -> str:
        line, text = section.get(key, (0, f"'{default}'"))
        value = text.strip("'\"")
        for ours, theirs in table.items():
            if theirs == value:
                return ours
        expected = ", ".join(table.values())
        raise InputError(
            f"{name}, line {line}: {key} {value!r} has no counterpart; expected {expected}"
        )

    kind = one("Type", {"mamdani": "mamdani", "sugeno": "sugeno"}, "mamdani")
    settings: dict[str, Any] = {
        "inference": kind,
        "and_": one("AndMethod", _AND, "min"),
        "or_": one("OrMethod", _OR, "max"),
        "neutral_rule": False,
        "normalisation": "per_output",
    }
    if kind == "mamdani":
        return settings | {
            "implication": one("ImpMethod", _AND, "min"),
            "aggregation": one("AggMethod", _AGGREGATIONS, "max"),
            "defuzzifier": one("DefuzzMethod", _DEFUZZIFIERS, "centroid"),
        }
    averages = {"per_output": "wtaver", "weighted_sum": "wtsum"}
    return settings | {"normalisation": one("DefuzzMethod", averages, "wtaver")}


def _read_variable(
    file: str, kind: str, section: Section, taken: Sequence[str], findings: list[Finding]
) -> Variable:
    line, original = section.get("Name", (0, ""))
    name = _identifier(file, line, original, taken, findings)
    terms: list[Term] = []
    for key, (at, text) in section.items():
        if re.fullmatch(r"MF\d+", key):
            if key != f"MF{len(terms) + 1}":
                raise InputError(f"{file}, line {at}: expected MF{len(terms) + 1}, found {key}")
            terms.append(_read_term(file, at, text, [t.name for t in terms], findings))
    _announced(file, section, "NumMFs", len(terms))
    at, text = section.get("Range", (line, "[0 1]"))
    low, high = _at(file, at, lambda: _numbers(text, 2))
    bounds = None if kind == "output" and (low, high) == (0, 1) else (low, high)
    if kind == "output":
        # MATLAB answers the middle of the range where nothing fires.
        middle = (low + high) / 2
        return _at(
            file,
            at,
            lambda: Variable(name, "output", terms=tuple(terms), range=bounds, default=middle),
        )
    guess = guessed_input(name)
    return _at(
        file,
        at,
        lambda: Variable(name, "input", guess.role, guess.axis, terms=tuple(terms), range=bounds),
    )


def _read_term(
    file: str, line: int, text: str, taken: Sequence[str], findings: list[Finding]
) -> Term:
    match = re.fullmatch(r"'([^']*)'\s*:\s*'(\w+)'\s*,\s*\[([^\]]*)\]", text)
    if not match:
        raise InputError(f"{file}, line {line}: expected 'name':'kind',[numbers], found {text!r}")
    name = _identifier(file, line, match[1], taken, findings)
    kind, numbers = match[2], match[3]
    return _at(file, line, lambda: _made_term(name, kind, _numbers(numbers, None)))


def _made_term(name: str, kind: str, values: tuple[float, ...]) -> Term:
    if kind in ("linsmf", "linzmf"):
        return Term(name, "ramp", values if kind == "linsmf" else values[::-1])
    if kind in ("constant", "linear"):
        return Term(name, kind, values)
    for ours, (theirs, order) in _KINDS.items():
        if theirs == kind and len(order) == len(values):
            return Term(name, ours, tuple(values[order.index(i)] for i in range(len(order))))
        if theirs == kind:
            raise InputError(f"{kind} has {len(values)} parameters; expected {len(order)}")
    known = ", ".join(theirs for theirs, _ in _KINDS.values())
    raise InputError(f"the term {kind!r} has no counterpart; expected one of {known}")


def _identifier(
    file: str, line: int, original: str, taken: Sequence[str], findings: list[Finding]
) -> str:
    """Return a name that rules can use; MATLAB's may have blanks."""
    original = original.strip("'\"")
    name = re.sub(r"\W", "_", original) or "unnamed"
    name = name if name.isidentifier() and name.upper() not in KEYWORDS else f"v_{name}"
    while name in taken:
        name += "_"
    if name != original:
        where = f"{file}, line {line}"
        findings.append(finding("NAME_CHANGED", where, f"{original!r} is now called {name}"))
    return name


def _numbers(text: str, count: int | None) -> tuple[float, ...]:
    try:
        values = tuple(map(float, text.strip("[] ").replace(",", " ").split()))
    except ValueError:
        raise InputError(f"expected numbers, found {text!r}") from None
    if count is not None and len(values) != count:
        raise InputError(f"expected {count} numbers, found {text!r}")
    return values


def _read_rule(text: str, variables: Sequence[Variable]) -> Rule:
    match = re.fullmatch(r"([^,]*),([^(]*)\(([^)]*)\)\s*:\s*([12])", text)
    if not match:
        raise InputError(f"expected indices, indices (weight) : 1 or 2, found {text!r}")
    parts: list[Proposition] = []
    said = []
    for kind, indices in (("input", match[1]), ("output", match[2])):
        columns = [v for v in variables if v.kind == kind]
        for variable, index in zip(columns, _numbers(indices, len(columns)), strict=True):
            if index == 0:
                continue
            if index not in range(-len(variable.terms), len(variable.terms) + 1):
                raise InputError(
                    f"rule {rule_name(text)}: {variable.name} has no term {index:g}; it has "
                    f"{len(variable.terms)}"
                )
            term = variable.terms[int(abs(index)) - 1].name
            if kind == "input":
                parts.append(Proposition(variable.name, term, ("not",) if index < 0 else ()))
            elif index > 0:
                said.append((variable.name, term))
            else:
                raise InputError(
                    f"rule {rule_name(text)}: a conclusion with NOT has no counterpart"
                )
    if not parts or not said:
        raise InputError(f"rule {rule_name(text)} has no condition or no conclusion; remove it")
    (weight,) = _numbers(match[3], 1)
    how: Literal["and", "or"] = "and" if match[4] == "1" else "or"
    condition = parts[0] if len(parts) == 1 else Combined(how, tuple(parts))
    return Rule(text, condition, tuple(said), weight)
