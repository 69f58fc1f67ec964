"""Fuzzy systems from MATLAB's .fis: sections of ``key=value``, rules as indices of terms."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding, finding
from usdface.fuzzy.rule_parser import KEYWORDS
from usdface.fuzzy.rules import Combined, Proposition, Rule, rule_name
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable, check_counts
from usdface.io.fuzzy_formats.draft import Draft, read_text
from usdface.io.fuzzy_formats.fis_keywords import (
    AGGREGATIONS,
    AND,
    DEFUZZIFIERS,
    HEDGES,
    KINDS,
    OCTAVES_S_NORMS,
    OCTAVES_T_NORMS,
    OR,
    RAMPS,
    counts_from_0,
)
from usdface.io.fuzzy_formats.fis_sections import Section, check_announced, located, sections
from usdface.io.fuzzy_formats.format_limits import kept_in_range
from usdface.io.fuzzy_formats.metadata_comments import finish

__all__ = ["read_fis"]

_MOST_INDEX = 1e6  # of a term; no variable has as many

Table = Mapping[str, str]


def read_fis(path: Path) -> tuple[ExpressionSystem, list[Finding]]:
    """Read a system from .fis.

    Raises
    ------
    InputError
        If it is no .fis, or uses an unsupported feature; the message names the line.
    """
    found, notes = sections(path.name, read_text(path))
    findings: list[Finding] = []
    system = found.get("System", {})
    if not system:
        raise InputError(f"{path.name} has no [System] section; it is no fuzzy system of MATLAB")
    variables: list[Variable] = []
    inputs = sum(1 for name in found if re.fullmatch(r"Input\d+", name))
    for kind in ("Input", "Output"):
        count = sum(1 for name in found if re.fullmatch(rf"{kind}\d+", name))
        located(path.name, 1, partial(check_counts, variables=count))
        check_announced(path.name, system, f"Num{kind}s", count)
        for i in range(count):
            section = found.get(f"{kind}{i + 1}")
            if section is None:
                raise InputError(f"{path.name} has {count} {kind} sections but no [{kind}{i + 1}]")
            taken = [v.name for v in variables]
            variables.append(
                _read_variable(path.name, kind.lower(), section, taken, inputs, findings)
            )
    if not variables:
        raise InputError(f"{path.name} has no variables; it is no fuzzy system of MATLAB")
    rules = [
        replace(
            located(path.name, line, partial(_read_rule, text, variables)),
            place=f"{path.name}, line {line}",
        )
        for line, text in found.get("Rules", {}).values()
    ]
    check_announced(path.name, system, "NumRules", len(rules))
    settings = _read_settings(path.name, system)
    draft = Draft(tuple(variables), tuple(rules), settings, tuple(notes), tuple(findings))
    made, consequents = finish(path, draft)
    return made, consequents + _read_otherwise(path.name, made.fuzzy, bool(notes))


def _read_otherwise(name: str, system: FuzzySystem, ours: bool) -> list[Finding]:
    """Return findings on differences to MATLAB; files of usdface got them when written."""
    if ours:
        return []
    findings = kept_in_range(name, system.outputs)
    if counts_from_0(system):
        message = (
            "{defuzzifier} takes the values as they are, MATLAB their distance to 0; shift "
            "the range above 0, or use mom"
        )
        findings.append(finding("MEANING_DIFFERS", name, message, system.defuzzifier))
    return findings


def _read_settings(name: str, section: Section) -> dict[str, Any]:
    def one(key: str, table: Table, default: str, more: Table = MappingProxyType({})) -> str:
        line, text = section.get(key, (0, f"'{default}'"))
        # fuzzylite leaves settings empty that no rule needs.
        value = text.strip("'\"") or default
        for ours, theirs in (*table.items(), *more.items()):
            if theirs == value:
                return ours
        expected = ", ".join(dict.fromkeys(table.values()))
        raise InputError(
            f"{name}, line {line}: {key} {value!r} has no counterpart; expected {expected}"
        )

    kind = one("Type", {"mamdani": "mamdani", "sugeno": "sugeno"}, "mamdani")
    settings: dict[str, Any] = {
        "inference": kind,
        "and_": one("AndMethod", AND, "min", OCTAVES_T_NORMS),
        "or_": one("OrMethod", OR, "max", OCTAVES_S_NORMS),
    }
    if kind == "mamdani":
        return settings | {
            "implication": one("ImpMethod", AND, "min", OCTAVES_T_NORMS),
            "aggregation": one("AggMethod", AGGREGATIONS, "max", OCTAVES_S_NORMS),
            "defuzzifier": one("DefuzzMethod", DEFUZZIFIERS, "centroid"),
        }
    averages = {"per_output": "wtaver", "weighted_sum": "wtsum"}
    return settings | {"normalisation": one("DefuzzMethod", averages, "wtaver")}


def _read_variable(
    file: str,
    kind: str,
    section: Section,
    taken: Sequence[str],
    inputs: int,
    findings: list[Finding],
) -> Variable:
    line, original = section.get("Name", (0, ""))
    name = _identifier(file, line, original, taken, findings)
    terms = _read_terms(file, section, inputs, findings)
    check_announced(file, section, "NumMFs", len(terms))
    at, text = section.get("Range", (line, "[0 1]"))
    low, high = located(file, at, lambda: _numbers(text, 2))
    bounds = None if kind == "output" and (low, high) == (0, 1) else (low, high)
    if kind == "output":
        # MATLAB gives the middle of the range where nothing fires.
        middle = (low + high) / 2
        return located(
            file,
            at,
            lambda: Variable(name, "output", terms=tuple(terms), range=bounds, default=middle),
        )
    return located(file, at, lambda: Variable(name, "input", tuple(terms), bounds))


def _read_terms(file: str, section: Section, inputs: int, findings: list[Finding]) -> list[Term]:
    terms: list[Term] = []
    line, _ = section.get("Name", (0, ""))
    count = sum(1 for key in section if key.startswith("MF"))
    located(file, line, partial(check_counts, terms=count))
    for key, (at, text) in section.items():
        if re.fullmatch(r"MF\d+", key):
            taken = [t.name for t in terms]
            terms.append(_read_term(file, at, text, taken, inputs, findings))
    return terms


def _read_term(
    file: str, line: int, text: str, taken: Sequence[str], inputs: int, findings: list[Finding]
) -> Term:
    match = re.fullmatch(r"'([^']*)'\s*:\s*'(\w+)'\s*,\s*\[([^\]]*)\]", text)
    if not match:
        raise InputError(f"{file}, line {line}: expected 'name':'kind',[numbers], found {text!r}")
    name = _identifier(file, line, match[1], taken, findings)
    kind, numbers = match[2], match[3]
    return located(file, line, lambda: _made_term(name, kind, _numbers(numbers, None), inputs))


def _made_term(name: str, kind: str, values: tuple[float, ...], inputs: int) -> Term:
    wanted = {theirs: len(order) for theirs, order in KINDS.values()} | RAMPS
    wanted |= {"constant": 1, "linear": inputs + 1}
    # Files of the first version fill up with zeros.
    if kind in wanted and not any(values[wanted[kind] :]):
        values = values[: wanted[kind]]
    if kind in RAMPS:
        return Term(name, "ramp", values[::-1] if kind == "linzmf" else values)
    if kind in ("constant", "linear"):
        return Term(name, kind, values)
    for ours, (theirs, order) in KINDS.items():
        if theirs == kind and len(order) == len(values):
            return Term(name, ours, tuple(values[order.index(i)] for i in range(len(order))))
        if theirs == kind:
            raise InputError(f"{kind} has {len(values)} parameters; expected {len(order)}")
    known = ", ".join(wanted)
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
        findings.append(
            finding("NAME_CHANGED", where, "{original!r} is now called {name}", original, name)
        )
    return name


def _numbers(text: str, count: int | None) -> tuple[float, ...]:
    try:
        values = tuple(map(float, text.strip("[] ").replace(",", " ").split()))
    except ValueError:
        raise InputError(f"expected numbers, found {text!r}") from None
    if count is not None and len(values) != count:
        raise InputError(f"expected {count} number{'s' * (count != 1)}, found {text!r}")
    return values


def _read_rule(text: str, variables: Sequence[Variable]) -> Rule:
    match = re.fullmatch(r"([^,]*),([^(]*)\(([^)]*)\)\s*:\s*([12])", text)
    if not match:
        raise InputError(f"expected indices, indices (weight) : 1 or 2, found {text!r}")
    parts: list[Proposition] = []
    consequents = []
    for kind, indices in (("input", match[1]), ("output", match[2])):
        columns = [v for v in variables if v.kind == kind]
        for variable, index in zip(columns, _numbers(indices, len(columns)), strict=True):
            if index == 0:
                continue
            term, hedges = _term_and_hedges(text, variable, index)
            if kind == "input":
                parts.append(Proposition(variable.name, term, hedges))
            elif not hedges:
                consequents.append((variable.name, term))
            else:
                raise InputError(
                    f"rule {rule_name(text)}: a conclusion with {' '.join(hedges).upper()} has no "
                    "counterpart; give the output a term of its own for it"
                )
    if not parts or not consequents:
        raise InputError(f"rule {rule_name(text)} has no condition or no conclusion; remove it")
    (weight,) = _numbers(match[3], 1)
    how: Literal["and", "or"] = "and" if match[4] == "1" else "or"
    condition = parts[0] if len(parts) == 1 else Combined(how, tuple(parts))
    return Rule(text, condition, tuple(consequents), weight)


def _term_and_hedges(text: str, variable: Variable, index: float) -> tuple[str, tuple[str, ...]]:
    """Return the term and the hedges that an index stands for."""
    whole, hundredths = divmod(round(100 * abs(index)), 100) if abs(index) < _MOST_INDEX else (0, 0)
    if not 1 <= whole <= len(variable.terms):
        raise InputError(
            f"rule {rule_name(text)}: {variable.name} has no term {index:g}; it has "
            f"{len(variable.terms)}"
        )
    if hundredths not in HEDGES:
        raise InputError(
            f"rule {rule_name(text)}: the hedge of {index:g} has no counterpart; expected .05 "
            "(somewhat), .20 (very) or .40 (very very)"
        )
    return variable.terms[whole - 1].name, ("not",) * (index < 0) + HEDGES[hundredths]
