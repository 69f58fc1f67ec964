"""Fuzzy systems from FCL, as IEC 61131-7:2000 has it, and as fuzzylite and jFuzzyLogic do."""

import re
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding, finding
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.draft import Draft, read_text, set_once
from usdface.io.fuzzy_formats.fcl_keywords import (
    ACCU,
    AND,
    DUAL_AND,
    DUAL_OR,
    JFUZZY_NORMS,
    METHODS,
    OR,
)
from usdface.io.fuzzy_formats.fcl_statements import BARE, NAMED, Statement, statements
from usdface.io.fuzzy_formats.fcl_terms import known, number, read_term
from usdface.io.fuzzy_formats.format_limits import kept_in_range, repeated_singletons
from usdface.io.fuzzy_formats.metadata_comments import finish

__all__ = ["read_fcl"]


def read_fcl(path: Path) -> tuple[ExpressionSystem, list[Finding]]:
    """Read a system from FCL: the file's one function block.

    Raises
    ------
    InputError
        If it is no FCL, or uses an unsupported feature; the message names the line.
    """
    text = read_text(path)
    notes = tuple(
        (at, line.strip()[2:].strip().removeprefix("usdface:"))
        for at, line in enumerate(text.splitlines(), start=1)
        if re.match(r"\s*//\s*usdface:", line)
    )
    parser = _Parser(path.name)
    for statement in statements(path.name, text):
        try:
            parser.take(statement)
        except InputError as error:
            raise InputError(f"{path.name}, line {statement.line}: {error}") from error
    system, findings = finish(path, parser.draft(notes))
    if not notes:  # files of usdface got them when written
        fuzzy = system.fuzzy
        clipped = kept_in_range(path.name, fuzzy.outputs) if fuzzy.inference == "sugeno" else []
        findings = [*findings, *clipped, *repeated_singletons(path.name, fuzzy)]
    return system, findings


@dataclass(slots=True)
class _Parts:
    """The parts of one variable that were read so far."""

    kind: str
    terms: list[Term] = field(default_factory=list)
    places: list[float] = field(default_factory=list)  # where terms have points
    range: tuple[float, float] | None = None
    default: float | None = None


class _Parser:
    """The blocks of a file, as they come."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._block = ""
        self._current = ""
        self._blocks = 0
        self._variables: dict[str, _Parts] = {}
        self._rules: list[Rule] = []
        self._settings: dict[str, Any] = {}

    def take(self, statement: Statement) -> None:
        first, words = statement.first, statement.words
        if first.startswith("END_"):
            self._block = ""
        elif first in BARE or first in NAMED:
            self._begin(first, words)
        elif self._block == "VAR":
            return
        elif self._block in ("VAR_INPUT", "VAR_OUTPUT"):
            self._declare(statement)
        elif self._block in ("FUZZIFY", "DEFUZZIFY"):
            self._describe(statement)
        elif self._block == "RULEBLOCK":
            self._rule_block(statement)
        else:
            raise InputError(f"{str(statement)[:60]!r} is in no block")

    def _begin(self, block: str, words: tuple[str, ...]) -> None:
        if block == "FUNCTION_BLOCK":
            self._blocks += 1
            if self._blocks > 1:
                raise InputError("a second FUNCTION_BLOCK; put each system into a file of its own")
            return
        self._block = block
        if block in ("FUZZIFY", "DEFUZZIFY"):
            kind = "input" if block == "FUZZIFY" else "output"
            if len(words) < 2:
                raise InputError(f"{block} names no {kind}")
            if words[1] not in self._variables or self._variables[words[1]].kind != kind:
                raise InputError(f"{block} {words[1]}: there is no {kind} of that name")
            self._current = words[1]

    def _declare(self, statement: Statement) -> None:
        words = statement.words
        kind = "input" if self._block == "VAR_INPUT" else "output"
        if len(words) < 3 or words[1] != ":" or words[2].upper() not in ("REAL", "LREAL"):
            raise InputError(f"expected 'name : REAL;', found {str(statement)[:60]!r}")
        if words[0] in self._variables:
            raise InputError(f"the variable {words[0]!r} is there already; names must be unique")
        self._variables[words[0]] = _Parts(kind)

    def _describe(self, statement: Statement) -> None:
        parts, words = self._variables[self._current], statement.words
        if statement.first == "TERM" and len(words) > 3 and words[2] == ":=":
            parts.terms.append(read_term(words[1], words[3:]))
            parts.places += [number(x) for mark, x in pairwise(words[3:]) if mark == "("]
        elif statement.first == "RANGE" and len(words) == 7 and words[4] == "..":
            parts.range = (number(words[3]), number(words[5]))
        elif statement.first == "DEFAULT" and len(words) == 3:
            parts.default = None if words[2].upper() in ("NC", "NAN") else number(words[2])
        elif statement.first == "METHOD" and len(words) == 3:
            self._method(words[2].upper())
        elif statement.first == "ACCU" and len(words) == 3:
            set_once(
                self._settings,
                "aggregation",
                known(words[2], ACCU, "ACCU", JFUZZY_NORMS["aggregation"]),
            )
        else:
            raise InputError(f"{str(statement)[:60]!r} has no counterpart")

    def _method(self, method: str) -> None:
        if method == "COGS":
            set_once(self._settings, "inference", "sugeno")
        else:
            set_once(self._settings, "inference", "mamdani")
            set_once(self._settings, "defuzzifier", known(method, METHODS, "METHOD"))

    def _rule_block(self, statement: Statement) -> None:
        words = statement.words
        if statement.first == "RULE" and ":" in words:
            rule = _read_rule(words[words.index(":") + 1 :])
            self._rules.append(replace(rule, place=f"{self._name}, line {statement.line}"))
            return
        tables = {
            "AND": ("and_", AND),
            "OR": ("or_", OR),
            "ACT": ("implication", AND),
            "ACCU": ("aggregation", ACCU),
        }
        if statement.first not in tables or len(words) != 3:
            raise InputError(f"{str(statement)[:60]!r} has no counterpart")
        setting, table = tables[statement.first]
        more = JFUZZY_NORMS.get(setting, {})
        set_once(self._settings, setting, known(words[2], table, statement.first, more))

    def draft(self, notes: tuple[tuple[int, str], ...]) -> Draft:
        if not self._variables:
            raise InputError(f"{self._name} has no variables; it is no fuzzy system in FCL")
        if self._block:
            raise InputError(f"{self._name} ends inside {self._block}; the file is cut off")
        settings = dict(self._settings)
        # The standard lets either stand for both.
        if "and_" in settings:
            settings.setdefault("or_", DUAL_OR[settings["and_"]])
        elif "or_" in settings:
            settings["and_"] = DUAL_AND[settings["or_"]]
        findings: list[Finding] = []
        variables = [self._made(name, p, findings) for name, p in self._variables.items()]
        return Draft(tuple(variables), tuple(self._rules), settings, notes, tuple(findings))

    def _made(self, name: str, parts: _Parts, findings: list[Finding]) -> Variable:
        terms = tuple(parts.terms)
        try:
            if parts.kind == "input":
                return Variable(name, "input", terms, parts.range)
            default = parts.default
            span = parts.range or _span(terms, parts.places, default)
            if default is None:
                default = min(max(0.0, span[0]), span[1])
                where = f"{self._name}: {name}"
                message = "{variable} has no default; where nothing fires it is {default:g}"
                findings.append(finding("MEANING_DIFFERS", where, message, name, default))
            terms_end = _span(terms, parts.places, None)
            if (
                not parts.range
                and span != terms_end
                and self._settings.get("inference") == "mamdani"
            ):
                where = f"{self._name}: {name}"
                message = (
                    "{variable} has no range; with its default it is {low:g} to {high:g}, beyond "
                    "its terms, and terms that stay at 1 reach to its ends"
                )
                findings.append(finding("MEANING_DIFFERS", where, message, name, *span))
            bounds = None if span == (0.0, 1.0) else span
            return Variable(name, "output", terms=terms, range=bounds, default=default)
        except InputError as error:
            raise InputError(f"{self._name}: {error}") from error


def _span(
    terms: tuple[Term, ...], places: list[float], default: float | None
) -> tuple[float, float]:
    """Return a range for an output without one: that of its terms and its default."""
    marks = [p for t in terms if t.kind != "linear" for p in t.parameters if isfinite(p)]
    marks += places + ([] if default is None else [default])
    low, high = min(marks, default=0.0), max(marks, default=1.0)
    return (low, high) if low < high else (min(low, 0.0), max(high, 1.0))


def _read_rule(words: tuple[str, ...]) -> Rule:
    weight = 1.0
    if len(words) > 2 and words[-2].upper() == "WITH":
        weight, words = number(words[-1]), words[:-2]
    then = next((i for i, word in enumerate(words) if word.upper() == "THEN"), len(words))
    consequent_words = ("AND" if word == "," else word for word in words[then:])
    return parse_rule(" ".join((*words[:then], *consequent_words)), weight)
